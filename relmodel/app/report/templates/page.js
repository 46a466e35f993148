(function () {
  const found = document.getElementById("data");
  const data = found ? JSON.parse(found.textContent) : {};
  const items = data.items || [];
  const buttons = [...document.querySelectorAll("[data-item]")];
  const pictures = [...document.querySelectorAll("svg.picture")];
  let viewer = null, chosen = new Set();

  // What an item is drawn by: ids of arcs in the pictures, a part of the model, surfaces of it (all where none are named).
  const owners = new Map();
  items.forEach((item, number) => item.arcs.forEach(id => owners.set(id, [...(owners.get(id) || []), number])));

  function light(ids, name) {
    document.querySelectorAll(".picture path." + name).forEach(p => p.classList.remove(name));
    for (const id of ids) { const path = document.getElementById(id); if (path) path.classList.add(name); }
  }
  function show(numbers, ids) {
    chosen = new Set(numbers);
    light(ids || numbers.flatMap(n => items[n].arcs), "lit");
    pictures.forEach(p => p.classList.toggle("chosen", Boolean(numbers.length || ids && ids.length)));
    buttons.forEach((b, n) => b.setAttribute("aria-pressed", chosen.has(n)));
    const parts = new Map();
    for (const n of numbers) {
      const { part, surfaces } = items[n];
      if (part === null || part === undefined) continue;
      parts.set(part, surfaces && parts.get(part) !== null ? new Set([...(parts.get(part) || []), ...surfaces]) : null);
    }
    if (viewer) viewer.choose(parts);
  }
  function reveal(number) {
    if (!buttons[number]) return;
    const list = buttons[number].closest("ol"), box = buttons[number].getBoundingClientRect(), frame = list.getBoundingClientRect();
    if (box.top < frame.top || box.bottom > frame.bottom) list.scrollTop += box.top - frame.top - frame.height / 3;
  }
  function toggle(number) { show(chosen.has(number) ? [] : [number]); if (chosen.has(number)) reveal(number); }

  // The list.
  buttons.forEach((button, number) => {
    button.addEventListener("click", () => toggle(number));
    button.addEventListener("mouseenter", () => { if (!chosen.size) { light(items[number].arcs, "lit"); } });
    button.addEventListener("mouseleave", () => { if (!chosen.size) light([], "lit"); });
    button.addEventListener("keydown", e => {
      const step = { ArrowDown: 1, ArrowUp: -1 }[e.key];
      if (!step) return;
      e.preventDefault();
      for (let n = number + step; n >= 0 && n < buttons.length; n += step)
        if (!buttons[n].parentNode.hidden) { buttons[n].focus(); break; }
    });
  });
  document.querySelectorAll("[data-choose]").forEach(b => b.addEventListener("click", () => {
    show([+b.dataset.choose]); reveal(+b.dataset.choose);
    (document.getElementById("pictures") || document.getElementById("model")).scrollIntoView({ block: "start" });
  }));
  const filter = document.getElementById("filter");
  if (filter) filter.addEventListener("input", () => {
    const words = filter.value.toLowerCase();
    buttons.forEach(b => { b.parentNode.hidden = !b.textContent.toLowerCase().includes(words); });
  });
  document.addEventListener("keydown", e => { if (e.key === "Escape") show([]); });

  // Layers drawn over the pictures.
  document.querySelectorAll("[data-layer]").forEach(box => box.addEventListener("change", () =>
    document.getElementById("pictures").classList.toggle("show-" + box.dataset.layer, box.checked)));

  // Pictures: what lies under the pointer is named and chosen; nearer, farther and moved.
  const around = [[0, 0]];
  for (const r of [3, 6]) for (let k = 0; k < 8; k++) around.push([r * Math.cos(k * Math.PI / 4), r * Math.sin(k * Math.PI / 4)]);
  function under(svg, event) {
    let region = null;
    for (const [dx, dy] of around) {
      const hit = document.elementFromPoint(event.clientX + dx, event.clientY + dy);
      if (!hit || hit.tagName !== "path" || !svg.contains(hit)) continue;
      if (!hit.classList.contains("region")) return hit;
      region = region || hit;
    }
    return region;
  }
  pictures.forEach(svg => {
    const width = +svg.dataset.width, height = +svg.dataset.height, readout = svg.parentNode.querySelector(".readout");
    let box = [-0.5, -0.5, width, height], held = null, moved = false, last = null;
    function frame(x, y, w) {
      w = Math.max(width / 64, Math.min(width, w));
      const h = w * height / width;
      box = [Math.max(-0.5, Math.min(width - 0.5 - w, x)), Math.max(-0.5, Math.min(height - 0.5 - h, y)), w, h];
      svg.setAttribute("viewBox", box.join(" ")); svg.classList.toggle("near", w < width);
    }
    function zoom(factor, u, v) { frame(box[0] + (1 - factor) * u * box[2], box[1] + (1 - factor) * v * box[3], box[2] * factor); }
    function place(e) { const r = svg.getBoundingClientRect(); return [(e.clientX - r.left) / r.width, (e.clientY - r.top) / r.height, r.width]; }
    svg.addEventListener("wheel", e => {
      if (document.activeElement === svg || e.ctrlKey) { e.preventDefault(); zoom(Math.exp(e.deltaY * 0.0015), ...place(e)); }
    }, { passive: false });
    svg.addEventListener("dblclick", e => zoom(0.5, ...place(e)));
    svg.addEventListener("pointerdown", e => { held = e; moved = false; });
    svg.addEventListener("pointerup", () => { held = null; });
    svg.addEventListener("pointerleave", () => { held = null; readout.textContent = ""; if (last) last.classList.remove("lit"); last = null; if (chosen.size) show([...chosen]); });
    svg.addEventListener("pointermove", e => {
      if (held && e.buttons) {
        const step = box[2] / place(e)[2], dx = e.clientX - held.clientX, dy = e.clientY - held.clientY;
        if (moved || Math.hypot(dx, dy) > 3) { moved = true; frame(box[0] - dx * step, box[1] - dy * step, box[2]); held = e; }
        return;
      }
      const hit = under(svg, e);
      if (hit === last) return;
      if (last && !chosen.size) last.classList.remove("lit");
      if (hit && !chosen.size && !hit.classList.contains("region")) hit.classList.add("lit");
      last = hit;
      const words = hit && hit.querySelector("title");
      readout.textContent = words ? words.textContent : "";
    });
    svg.addEventListener("click", e => {
      if (moved) return;
      const hit = under(svg, e), owned = hit ? owners.get(hit.id) || [] : [];
      if (!owned.length) { show([]); return; }
      const here = owned.findIndex(n => chosen.has(n)), next = owned[(here + owned.length) % owned.length];
      show([here < 0 ? owned[owned.length - 1] : next]); reveal([...chosen][0]);
    });
    const keys = { "+": () => zoom(0.7, 0.5, 0.5), "=": () => zoom(0.7, 0.5, 0.5), "-": () => zoom(1.4, 0.5, 0.5), "0": () => frame(-0.5, -0.5, width),
      ArrowLeft: () => frame(box[0] - box[2] / 8, box[1], box[2]), ArrowRight: () => frame(box[0] + box[2] / 8, box[1], box[2]),
      ArrowUp: () => frame(box[0], box[1] - box[3] / 8, box[2]), ArrowDown: () => frame(box[0], box[1] + box[3] / 8, box[2]) };
    svg.addEventListener("keydown", e => { if (keys[e.key]) { e.preventDefault(); keys[e.key](); } });
  });

  // Rows of tables that stand for arcs.
  document.querySelectorAll("tr[data-marks]").forEach(row => {
    const ids = row.dataset.marks.split(" ").filter(Boolean);
    function choose() {
      const on = !row.classList.contains("lit");
      document.querySelectorAll("tr.lit").forEach(r => r.classList.remove("lit"));
      row.classList.toggle("lit", on); show([], on ? ids : []);
      const first = document.getElementById("tab-seen");
      if (on && first) first.checked = true;  // where the pictures are
      const path = on && ids.length && document.getElementById(ids[0]);
      if (path) path.closest("figure").scrollIntoView({ block: "nearest", behavior: "auto" });
    }
    row.addEventListener("click", choose);
    row.addEventListener("keydown", e => { if (e.key === "Enter" || e.key === " ") { e.preventDefault(); choose(); } });
  });

  // The model.
  const canvas = document.getElementById("canvas");
  if (canvas && data.scene) {
    const byPart = new Map();
    items.forEach((item, number) => { if (item.part !== null && item.part !== undefined && !item.surfaces) byPart.set(item.part, number); });
    viewer = makeViewer(canvas, data.scene, part => {
      const words = document.getElementById("model-part");
      if (part < 0) { show([]); words.textContent = ""; return; }
      putBoxAbout(part);
      if (byPart.has(part)) { show([byPart.get(part)]); reveal(byPart.get(part)); } else { show([]); viewer.choose(new Map([[part, null]])); }
      words.textContent = data.scene.parts[part].path;
    });
    if (!viewer) document.getElementById("model-part").textContent = "This browser draws no WebGL 2: the model is not shown.";
    document.querySelectorAll("[data-view]").forEach(b => b.addEventListener("click", () => viewer && viewer.look(b.dataset.view)));
  }

  // The box that is asked of a world: drawn as its fields say; a slider moves a face of it, a click on a part puts it about that.
  const bounds = ["x0", "y0", "z0", "x1", "y1", "z1"].map(n => document.querySelector(`.ask input[name="${n}"]`));
  const sliders = bounds.map(f => f && document.querySelector(`[data-bound="${f.name}"]`));
  const drawBox = () => { if (viewer && sliders[0]) viewer.box(bounds.map(f => +f.value)); };
  function putBoxAbout(part) {
    if (sliders[0]) viewer.bounds(part).forEach((at, i) => { bounds[i].value = i < 3 ? Math.floor(at) : Math.ceil(at); sliders[i].value = at; });
    drawBox();
  }
  sliders.forEach((slider, i) => {
    if (!slider) return;
    slider.addEventListener("input", () => { bounds[i].value = slider.value; drawBox(); });
    bounds[i].addEventListener("input", () => { slider.value = bounds[i].value; drawBox(); });
  });
  drawBox();

  // A link to a finding or a feature opens what it stands in: #finding=3, #feature=bulkhead/BODY/rib 16.
  function follow() {
    const [kind, name] = decodeURIComponent(location.hash.slice(1)).split(/=(.*)/s);
    const found = [...document.querySelectorAll(`[data-${kind === "finding" ? "finding" : "feature"}]`)].find(e => e.dataset[kind] === name);
    if (!found) return;
    const first = document.getElementById("tab-seen");
    if (first) first.checked = true;
    for (let fold = found.closest("details"); fold; fold = fold.parentNode.closest("details")) fold.open = true;
    document.querySelectorAll(".linked").forEach(e => e.classList.remove("linked"));
    found.classList.add("linked"); found.scrollIntoView({ block: "start" });
    const button = found.closest("[data-choose]") || found.querySelector("[data-choose]");
    if (button) { show([+button.dataset.choose]); reveal(+button.dataset.choose); }
  }
  addEventListener("hashchange", follow);
  if (location.hash.includes("=")) follow();
  // What is folded is printed.
  addEventListener("beforeprint", () => document.querySelectorAll("details.group").forEach(d => { d.open = true; }));

  // Forms that ask again as soon as something is chosen.
  document.querySelectorAll("select[data-ask]").forEach(s => s.addEventListener("change", () => s.form.submit()));
})();
