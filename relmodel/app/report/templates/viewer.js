"use strict";
// The model in three dimensions: parts as triangles and edges, cameras and uncertainties as lines, turned by mouse or keys.
// `picked(part)` is called with the ordinal of the part that was clicked, or -1.  Gives null where there is no WebGL 2.
function makeViewer(canvas, scene, picked) {
  const gl = canvas.getContext("webgl2", { antialias: true, alpha: true, preserveDrawingBuffer: true });
  if (!gl) return null;
  const middle = scene.focus, up = scene.up, across = perpendicular(up), ahead = cross(up, across);
  const parts = scene.parts.map(p => ({ shape: p.shape, colour: p.colour, only: p.only, paint: (p.paint || []).map(([colour, list]) => [new Set(list), colour]), place: placed(p.m) }));
  let program, where, at, shapes, lines;  // what lies on the graphics card
  upload();
  const dark = matchMedia("(prefers-color-scheme: dark)");
  const none = new Map();
  let chosen = none, target, distance, fitted, yaw, pitch, looked = null, waiting = false;
  whole();

  function upload() {
    program = build(`#version 300 es
      uniform mat4 clip; uniform mat4 place; uniform vec3 lo; uniform vec3 size; in vec3 at; out vec3 seen;
      void main() { vec4 p = place * vec4(lo + size * at, 1.0); seen = p.xyz; gl_Position = clip * p; }`, `#version 300 es
      precision highp float; uniform vec4 colour; uniform vec3 eye; uniform float lit; in vec3 seen; out vec4 shown;
      void main() { float light = 1.0;  // a line has no normal: what comes of it is not a number
        if (lit > 0.0) light = 0.35 + 0.65 * abs(dot(normalize(cross(dFdx(seen), dFdy(seen))), normalize(eye - seen)));
        shown = vec4(colour.rgb * light, colour.a); }`);
    where = Object.fromEntries(["clip", "place", "lo", "size", "colour", "eye", "lit"].map(n => [n, gl.getUniformLocation(program, n)]));
    at = gl.getAttribLocation(program, "at");
    shapes = scene.shapes.map(s => ({ lo: s.lo, size: s.size, runs: s.s,
      vertices: buffer(gl.ARRAY_BUFFER, bytes(s.v)), triangles: buffer(gl.ELEMENT_ARRAY_BUFFER, triangles(s)),
      paint: (s.paint || []).map(([colour, list]) => [new Set(list), colour]), count: s.s.reduce((sum, [, , count]) => sum + count, 0), edges: buffer(gl.ARRAY_BUFFER, bytes(s.e)), ends: bytes(s.e).length / 6 }));
    put(scene.lines);
  }
  function put(drawn) {
    lines = drawn.map(l => ({ colour: l.colour, count: l.at.length / 3,
      buffer: buffer(gl.ARRAY_BUFFER, new Float32Array(l.at.map((x, i) => x - middle[i % 3]))) }));
  }
  // The edges of a box, x0 y0 z0 x1 y1 z1 of the world, in place of those before.
  function box(b) {
    const corner = k => [0, 1, 2].map(i => b[i + 3 * (k >> i & 1)]), at = [];
    for (let k = 0; k < 8; k++) for (let i = 0; i < 3; i++) if (!(k >> i & 1)) at.push(...corner(k), ...corner(k | 1 << i));
    scene.lines = [...scene.lines.filter(l => l.colour !== "chosen"), { colour: "chosen", at }];
    put(scene.lines); redraw();
  }
  function bounds(number) {  // of a part, in the same order
    const s = scene.shapes[scene.parts[number].shape], m = scene.parts[number].m, low = [], high = [];
    for (let i = 0; i < 3; i++) {
      const reach = [0, 1, 2].map(j => [m[4 * i + j] * s.lo[j], m[4 * i + j] * (s.lo[j] + s.size[j])]);
      low.push(m[4 * i + 3] + reach.reduce((sum, r) => sum + Math.min(...r), 0)); high.push(m[4 * i + 3] + reach.reduce((sum, r) => sum + Math.max(...r), 0));
    }
    return [...low, ...high];
  }
  function build(vertex, fragment) {
    const made = gl.createProgram();
    for (const [kind, text] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
      const shader = gl.createShader(kind);
      gl.shaderSource(shader, text); gl.compileShader(shader); gl.attachShader(made, shader);
    }
    gl.linkProgram(made);
    if (!gl.getProgramParameter(made, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(made));
    return made;
  }
  function buffer(kind, data) { const made = gl.createBuffer(); gl.bindBuffer(kind, made); gl.bufferData(kind, data, gl.STATIC_DRAW); return made; }
  function bytes(text) { return Uint8Array.from(atob(text), c => c.charCodeAt(0)); }
  function triangles(s) {  // each vertex is stored as the step from the one before
    let at = 0;
    return Uint32Array.from(new (s.wide ? Int32Array : Int16Array)(bytes(s.t).buffer), step => at += step);
  }
  function placed(m) {
    return [m[0], m[4], m[8], 0, m[1], m[5], m[9], 0, m[2], m[6], m[10], 0, m[3] - middle[0], m[7] - middle[1], m[11] - middle[2], 1];
  }
  function palette() {
    return dark.matches
      ? { plain: [.33, .37, .40], open: [.33, .37, .40], seen: [.62, .70, .76], edge: [0, 0, 0], pose: [.37, .83, .58], prior: [.94, .75, .33], chosen: [1, .85, .1], added: [.3, .75, .45], removed: [.9, .35, .3], changed: [.95, .65, .2] }
      : { plain: [.86, .88, .89], open: [.86, .88, .89], seen: [.66, .74, .80], edge: [.16, .19, .21], pose: [.10, .55, .32], prior: [.80, .48, 0], chosen: [1, .80, 0], added: [.25, .68, .42], removed: [.86, .30, .25], changed: [.93, .60, .15] };
  }

  function eyeAndMatrix() {
    const aspect = canvas.width / canvas.height;
    let eye, right, above, back, slope = 0.414 / Math.min(1, aspect);  // of the height; the narrower side is the one that counts
    if (looked) {
      const m = looked.m;
      eye = [m[3] - middle[0], m[7] - middle[1], m[11] - middle[2]];
      right = [m[0], m[4], m[8]]; above = [-m[1], -m[5], -m[9]]; back = [-m[2], -m[6], -m[10]];
      slope = Math.max(looked.slope[1], looked.slope[0] / aspect);
    } else {
      back = add(add(scaled(ahead, Math.cos(pitch) * Math.cos(yaw)), scaled(across, Math.cos(pitch) * Math.sin(yaw))), scaled(up, Math.sin(pitch)));
      eye = add(target, scaled(back, distance));
      right = unit(cross(up, back)); above = cross(back, right);
    }
    const near = looked ? 5 : Math.max(distance / 200, 1), far = near + distance + 6 * scene.radius + length(eye);
    const a = 1 / (slope * aspect), b = 1 / slope, c = (near + far) / (near - far), d = 2 * near * far / (near - far);
    const t = [-dot(right, eye), -dot(above, eye), -dot(back, eye)];
    return { eye, right, above, back, slope, clip: [0, 1, 2].flatMap(i => [
      a * right[i], b * above[i], c * back[i], -back[i]]).concat([a * t[0], b * t[1], c * t[2] + d, -t[2]]) };
  }

  function points(held, kind, normalised, stride) {
    gl.bindBuffer(gl.ARRAY_BUFFER, held); gl.enableVertexAttribArray(at); gl.vertexAttribPointer(at, 3, kind, normalised, stride, 0);
  }
  function draw(identities) {
    if (gl.isContextLost()) return;
    const view = eyeAndMatrix(), colours = palette();
    gl.viewport(0, 0, canvas.width, canvas.height);
    gl.clearColor(0, 0, 0, 0); gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    gl.enable(gl.DEPTH_TEST); gl.depthFunc(gl.LEQUAL); gl.useProgram(program);
    gl.uniformMatrix4fv(where.clip, false, view.clip); gl.uniform3fv(where.eye, view.eye);
    gl.enable(gl.POLYGON_OFFSET_FILL); gl.polygonOffset(1, 1);
    parts.forEach((part, number) => {
      const s = shapes[part.shape], kind = gl.UNSIGNED_INT;
      gl.uniformMatrix4fv(where.place, false, part.place); gl.uniform3fv(where.lo, s.lo); gl.uniform3fv(where.size, s.size);
      points(s.vertices, gl.UNSIGNED_SHORT, true, 6); gl.bindBuffer(gl.ELEMENT_ARRAY_BUFFER, s.triangles);
      const surfaces = chosen.get(number), own = number + 1;
      gl.uniform1f(where.lit, identities || part.only ? 0 : 1);
      gl.uniform4fv(where.colour, identities ? [(own & 255) / 255, (own >> 8 & 255) / 255, (own >> 16) / 255, 1] : [...(surfaces === null ? colours.chosen : colours[part.colour]), 1]);
      gl.depthFunc(part.only ? gl.ALWAYS : gl.LEQUAL);  // what is gone may lie inside what is there
      if (!part.only) gl.drawElements(gl.TRIANGLES, s.count, kind, 0);  // else what is painted alone
      if (identities) return;
      for (const [list, colour] of surfaces === null ? [] : [...s.paint, ...part.paint, [surfaces, colours.chosen]]) if (list) {
        gl.uniform4fv(where.colour, [...(typeof colour === "string" ? colours[colour] : colour), 1]);
        for (const [surface, first, count] of s.runs) if (list.has(surface)) for (const way of part.only ? [gl.TRIANGLES, gl.LINES] : [gl.TRIANGLES])  // as lines walls show end on too
          gl.drawElements(way, count, kind, 4 * first);
      }
      if (part.only) return;
      gl.uniform1f(where.lit, 0); gl.uniform4fv(where.colour, [...colours.edge, 1]);
      points(s.edges, gl.UNSIGNED_SHORT, true, 6); gl.drawArrays(gl.LINES, 0, s.ends);
    });
    if (identities) return;
    gl.uniformMatrix4fv(where.place, false, [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]);
    gl.uniform3fv(where.lo, [0, 0, 0]); gl.uniform3fv(where.size, [1, 1, 1]);
    for (const line of lines) {
      points(line.buffer, gl.FLOAT, false, 12);
      gl.uniform4fv(where.colour, [...colours[line.colour], 1]); gl.drawArrays(gl.LINES, 0, line.count);
    }
  }
  function redraw() {
    if (!waiting) { waiting = true; requestAnimationFrame(() => { waiting = false; draw(false); }); }
  }
  function fit() {
    const scale = Math.min(devicePixelRatio || 1, 2);
    const size = [canvas.clientWidth, canvas.clientHeight].map(n => Math.max(1, Math.round(n * scale)));
    if (size[0] === canvas.width && size[1] === canvas.height) return;
    const asWhole = distance === fitted;
    [canvas.width, canvas.height] = size; if (asWhole) whole();
    draw(false);  // at once: a new size clears what was drawn
  }
  function turn(dx, dy) { leave(); yaw -= dx; pitch = Math.max(-1.55, Math.min(1.55, pitch + dy)); redraw(); }
  function shift(dx, dy) {
    leave();
    const view = eyeAndMatrix(), step = 2 * view.slope * distance / canvas.clientHeight;
    target = add(target, add(scaled(view.right, -dx * step), scaled(view.above, dy * step))); redraw();
  }
  function nearer(factor) { leave(); distance = Math.max(scene.radius / 500, Math.min(20 * scene.radius, distance * factor)); redraw(); }
  function leave() {  // from looking through a camera to turning about what lies before it
    if (!looked) return;
    const view = eyeAndMatrix();
    distance = looked.depth; target = add(view.eye, scaled(view.back, -distance));
    from(view.back); looked = null;
  }
  function look(name) {
    looked = scene.views.find(v => v.name === name) || null;
    if (!looked) whole();
    redraw();
  }
  function whole() {  // as near as shows the boxes of all parts that are not plain
    target = [0, 0, 0]; distance = 1; from(unit(scene.from));
    const view = eyeAndMatrix(), aspect = canvas.width / canvas.height, shown = parts.filter(p => p.colour !== "plain");
    let least = scene.radius / 10;
    for (const part of shown.length ? shown : parts) for (let k = 0; k < 8; k++) {
      const s = scene.shapes[part.shape], m = part.place, at = [0, 1, 2].map(i => s.lo[i] + (k >> i & 1) * s.size[i]);
      const p = [0, 1, 2].map(i => m[i] * at[0] + m[4 + i] * at[1] + m[8 + i] * at[2] + m[12 + i]);
      const aside = Math.max(Math.abs(dot(p, view.right)) / aspect, Math.abs(dot(p, view.above))) / view.slope;
      least = Math.max(least, dot(p, view.back) + 1.03 * aside);
    }
    fitted = distance = least;
  }
  function from(back) { pitch = Math.asin(Math.max(-1, Math.min(1, dot(back, up)))); yaw = Math.atan2(dot(back, across), dot(back, ahead)); }
  function pick(event) {
    const box = canvas.getBoundingClientRect(), pixel = new Uint8Array(4), scale = canvas.width / box.width;
    draw(true);
    gl.readPixels((event.clientX - box.left) * scale, canvas.height - (event.clientY - box.top) * scale, 1, 1, gl.RGBA, gl.UNSIGNED_BYTE, pixel);
    draw(false); picked(pixel[3] ? pixel[0] + 256 * pixel[1] + 65536 * pixel[2] - 1 : -1);
  }
  let held = null, moved = false;
  canvas.addEventListener("pointerdown", e => { held = e; moved = false; canvas.setPointerCapture(e.pointerId); });
  canvas.addEventListener("pointermove", e => {
    if (!held) return;
    const dx = e.clientX - held.clientX, dy = e.clientY - held.clientY;
    if (!moved && Math.hypot(dx, dy) < 3) return;
    moved = true;
    if (e.shiftKey || e.buttons & 6) shift(dx, dy); else turn(dx * 0.008, dy * 0.008);
    held = e;
  });
  canvas.addEventListener("pointerup", e => { if (held && !moved) pick(e); held = null; });
  canvas.addEventListener("contextmenu", e => e.preventDefault());
  canvas.addEventListener("wheel", e => {
    if (document.activeElement === canvas) { e.preventDefault(); nearer(Math.exp(e.deltaY * 0.001)); }
  }, { passive: false });
  const keys = { ArrowLeft: () => turn(-0.1, 0), ArrowRight: () => turn(0.1, 0), ArrowUp: () => turn(0, 0.1), ArrowDown: () => turn(0, -0.1),
    "+": () => nearer(0.8), "=": () => nearer(0.8), "-": () => nearer(1.25), "0": () => look("") };
  canvas.addEventListener("keydown", e => { if (keys[e.key]) { e.preventDefault(); keys[e.key](); } });
  dark.addEventListener("change", redraw);
  // The context is lost where a computer sleeps or the driver starts anew.
  canvas.addEventListener("webglcontextlost", e => e.preventDefault());
  canvas.addEventListener("webglcontextrestored", () => { upload(); draw(false); });
  new ResizeObserver(fit).observe(canvas);
  fit(); draw(false);
  return { look, box, bounds, choose(found) { chosen = found || none; redraw(); } };

  function add(a, b) { return a.map((x, i) => x + b[i]); }
  function scaled(a, k) { return a.map(x => x * k); }
  function dot(a, b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
  function length(a) { return Math.sqrt(dot(a, a)); }
  function unit(a) { return scaled(a, 1 / length(a)); }
  function cross(a, b) { return [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]; }
  function perpendicular(a) { return unit(cross(a, Math.abs(a[0]) < 0.9 ? [1, 0, 0] : [0, 1, 0])); }
}
