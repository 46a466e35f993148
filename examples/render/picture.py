"""Photoreal grey pictures of the bulkhead with Mitsuba 3 (`llvm_ad_mono`), denoised with OIDN, and a sensor model.

All in the part's frame.  Needs the extra `render`, libLLVM (its full path in DRJIT_LIBLLVM_PATH) and a few minutes.
"""

from __future__ import annotations

import ctypes
import importlib.util
import math
from pathlib import Path
from typing import Any

import cv2
import numpy as np
from numpy.typing import NDArray

from examples.bulkhead.design import DEPTH
from examples.render.model import Component
from examples.render.views import HEIGHT, WIDTH, Camera, View, target_in_object

Array = NDArray[np.float64]
Image = NDArray[np.float32]
Index = NDArray[np.int64]
TILE_MM, TEXELS = 400.0, 1024
LAYS_DEG = (18.0, 104.0, 63.0, -31.0)
SAMPLES = 36


def _noise(rng: np.random.Generator, shape: tuple[int, int], along: float, across: float) -> Array:
    """Periodic Gaussian noise of unit deviation, blurred by sigmas in pixels along columns (x) and rows (y)."""
    fy, fx = np.fft.fftfreq(shape[0])[:, None], np.fft.fftfreq(shape[1])[None]
    blur = np.exp(-2 * np.pi**2 * ((along * fx) ** 2 + (across * fy) ** 2))
    field = np.fft.ifft2(np.fft.fft2(rng.normal(size=shape)) * blur).real
    field -= field.mean()
    return np.asarray(field / field.std())


def _bitmap(mi: Any, values: Array) -> dict[str, Any]:
    data = np.ascontiguousarray(values[..., None], np.float32)
    return {"type": "bitmap", "bitmap": mi.Bitmap(data), "raw": True, "wrap_mode": "repeat"}


def _materials(mi: Any, rng: np.random.Generator) -> dict[str, Any]:
    shape = (TEXELS, TEXELS)
    streak, blotch = _noise(rng, shape, 90, 0.9), _noise(rng, shape, 45, 30)
    waves = 0.003 * _noise(rng, shape, 120, 1.5) + 0.013 * _noise(rng, shape, 40, 25)
    rough = np.clip(1 + 0.12 * blotch, 0.7, 1.35)
    flat = {
        "type": "bumpmap",
        "arbitrary": _bitmap(mi, waves),
        "bsdf": {
            "type": "roughconductor",
            "material": "Al",
            "distribution": "ggx",
            "alpha_u": _bitmap(mi, 0.115 * rough),
            "alpha_v": _bitmap(mi, 0.27 * rough),
            "specular_reflectance": _bitmap(mi, np.clip(0.84 + 0.04 * streak, 0.6, 1.0)),
        },
    }

    def metal(name: str, alpha: float, reflectance: float) -> dict[str, Any]:
        value = {"type": "uniform", "value": reflectance}
        rough_metal = {"type": "roughconductor", "material": name, "distribution": "ggx", "alpha": alpha}
        return {**rough_metal, "specular_reflectance": value}

    plain = {
        "wall": metal("Al", 0.17, 0.84),
        "BUSHING_25": metal("Cu", 0.18, 0.9),
        "BOLT_M8": metal("Cr", 0.28, 0.8),
        "CLIP": metal("Al", 0.32, 0.45),
    }
    return {k: mi.load_dict({"type": "twosided", "bsdf": m}) for k, m in {"flat": flat, **plain}.items()}


def _mesh(mi: Any, name: str, vertices: Array, normals: Array, triangles: Index, uv: Array | None, bsdf: Any) -> Any:
    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    mesh = mi.Mesh(name, len(vertices), len(triangles), properties, True, uv is not None)
    parameters = mi.traverse(mesh)
    parameters["vertex_positions"] = np.ravel(vertices).astype(np.float32)
    parameters["vertex_normals"] = np.ravel(normals).astype(np.float32)
    parameters["faces"] = np.ravel(triangles).astype(np.uint32)
    if uv is not None:
        parameters["vertex_texcoords"] = np.ravel(uv).astype(np.float32)
    parameters.update()
    return mesh


def _select(vertices: Array, triangles: Index, keep: NDArray[np.bool_]) -> tuple[Index, Index]:
    """Vertex numbers and renumbered triangles of the triangles whose vertices are kept."""
    wanted = triangles[keep[triangles[:, 0]]]
    used, inverse = np.unique(wanted, return_inverse=True)
    return used, inverse.reshape(-1, 3)


def _part_meshes(mi: Any, components: list[Component], materials: dict[str, Any]) -> dict[str, Any]:
    """The body in two meshes (flats with lay, walls without) and each other component in one."""
    out = {}
    for number, component in enumerate(components):
        part, place = component.part, component.object_from_part
        vertices = part.vertices @ place[:3, :3].T + place[:3, 3]
        normals = part.normals @ place[:3, :3].T
        if part.name != "BULKHEAD_BODY":
            bsdf = materials[part.name]
            out[f"part_{number}"] = _mesh(mi, component.path, vertices, normals, part.triangles, None, bsdf)
            continue
        flat = np.abs(part.normals[:, 2]) > 0.999
        # One lay a face, picked by the face's level and number; the long rims keep one lay.
        lay = np.radians(np.array(LAYS_DEG))[(part.face * 7 + part.face // 5) % len(LAYS_DEG)]
        c, s = np.cos(lay), np.sin(lay)
        x, y = vertices[:, 0], vertices[:, 1]
        uv = np.column_stack([c * x + s * y, -s * x + c * y]) / TILE_MM + (part.face * 0.37)[:, None] % 1.0
        for label, keep in (("flat", flat), ("wall", ~flat)):
            used, triangles = _select(vertices, part.triangles, keep)
            mesh_uv = uv[used] if label == "flat" else None
            mesh = _mesh(mi, label, vertices[used], normals[used], triangles, mesh_uv, materials[label])
            out[f"body_{label}"] = mesh
    return out


def _facing(mi: Any, origin: Array, target: Array) -> Any:
    up = [0.0, 1.0, 0.0] if abs((target - origin)[1]) < 0.9 * np.linalg.norm(target - origin) else [1.0, 0.0, 0.0]
    return mi.ScalarTransform4f().look_at(origin=origin.tolist(), target=target.tolist(), up=up)


def _lights(mi: Any, view: View, middle: Array, rng: np.random.Generator) -> dict[str, Any]:
    """A disk near the mirror direction, a tube, a soft box and a small raking box, and a blotchy surrounding."""
    target = target_in_object(view)
    out_of_face = np.array([0, 0, -1.0 if view.back else 1.0])
    sight = (middle - target) / np.linalg.norm(middle - target)
    mirror = 2 * (sight @ out_of_face) * out_of_face - sight

    def place(direction: Array, distance: float) -> Array:
        return np.asarray(target + distance * direction / np.linalg.norm(direction))

    side = np.cross(out_of_face, mirror + np.array([0.3, 0.2, 0]))
    side /= np.linalg.norm(side)
    disk = place(mirror + 0.16 * rng.normal(size=3), rng.uniform(1500, 2000))
    tube = place(out_of_face + 0.9 * side + 0.2 * rng.normal(size=3), 1700)
    box = place(out_of_face - 0.8 * side + 0.5 * mirror, 2100)
    rake = place(0.35 * out_of_face + side * rng.choice([-1, 1]) + 0.4 * rng.normal(size=3) * [1, 1, 0], 1500)
    scale = mi.ScalarTransform4f().scale

    def light(shape: str, at: Array, size: tuple[float, float], radiance: float) -> dict[str, Any]:
        to_world = _facing(mi, at, target) @ scale([size[0], size[1], 1])
        return {
            "type": shape,
            "to_world": to_world,
            "emitter": {"type": "area", "radiance": {"type": "uniform", "value": radiance}},
        }

    surround = np.clip(0.28 + 0.22 * _noise(rng, (128, 256), 9, 7), 0.02, 1.2)
    surround += np.linspace(0.35, 0.0, 128)[:, None]
    env = {"type": "envmap", "bitmap": mi.Bitmap(np.repeat(surround[..., None], 3, 2).astype(np.float32)), "scale": 0.4}
    return {
        "disk": light("disk", disk, (rng.uniform(170, 280),) * 2, 9.0),
        "tube": light("rectangle", tube, (34, 850), 14.0),
        "box": light("rectangle", box, (420, 380), 3.0),
        "rake": light("rectangle", rake, (55, 70), 45.0),
        "surround": env,
    }


def _backdrop(mi: Any, view: View, rng: np.random.Generator) -> dict[str, Any]:
    """A dark uneven wall behind the part, seen through its openings."""
    z = DEPTH + 420.0 if view.back else -420.0
    x, y = view.target
    towards = np.array([x, y, 0.0 if view.back else DEPTH])
    values = np.clip(0.05 + 0.02 * _noise(rng, (512, 512), 6, 6), 0.01, 0.12)
    return {
        "type": "rectangle",
        "to_world": _facing(mi, np.array([x, y, z]), towards) @ mi.ScalarTransform4f().scale([2400, 2400, 1]),
        "bsdf": {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": _bitmap(mi, values)}},
    }


def padded(camera: Camera) -> tuple[Camera, int]:
    """The camera without distortion that sees all that `camera` sees, and the margin in pixels on every side."""
    if not any(camera.distortion):
        return camera, 0
    margin = 72
    return Camera(camera.focal, (camera.centre[0] + margin, camera.centre[1] + margin)), margin


def _sensor(mi: Any, camera: Camera, size: tuple[int, int], pose: Array, focus: float) -> dict[str, Any]:
    """A thin lens whose crop window of a larger film puts the principal point where it belongs."""
    film, offset = [], []
    for pixels, centre in zip(size, camera.centre, strict=True):
        # centre = film / 2 - 0.5 - offset, with film and offset whole and the window inside the film
        offset.append(max(0, math.ceil(pixels - 2 * centre - 1)))
        film.append(round(2 * (centre + 0.5 + offset[-1])))
        if film[-1] < pixels + offset[-1]:
            raise ValueError("the crop window leaves the film")
    flip = np.diag([-1.0, -1.0, 1.0, 1.0])
    return {
        "type": "thinlens",
        "fov": math.degrees(2 * math.atan(film[0] / (2 * camera.focal))),
        "fov_axis": "x",
        "aperture_radius": 1.3,
        "focus_distance": focus,
        "near_clip": 10.0,
        "far_clip": 1e5,
        "to_world": mi.ScalarTransform4f(pose @ flip),
        "film": {
            "type": "hdrfilm",
            "width": film[0],
            "height": film[1],
            "crop_width": size[0],
            "crop_height": size[1],
            "crop_offset_x": offset[0],
            "crop_offset_y": offset[1],
            "pixel_format": "luminance",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter", "sample_count": SAMPLES},
    }


def render(view: View, components: list[Component], poses: tuple[Array, Array]) -> tuple[Image, Image]:
    """Linear pictures of both cameras (lens distortion applied), noise-free but for what the denoiser leaves."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_mono")
    rng = np.random.default_rng([view.seed, 3])
    middle = (poses[0][:3, 3] + poses[1][:3, 3]) / 2
    scene: dict[str, Any] = {"type": "scene", "integrator": {"type": "path", "max_depth": 5}}
    scene |= _part_meshes(mi, components, _materials(mi, np.random.default_rng(5)))
    scene |= _lights(mi, view, middle, rng)
    scene["backdrop"] = _backdrop(mi, view, rng)
    loaded = mi.load_dict(scene)
    out = []
    for k, (camera, pose) in enumerate(zip((view.left, view.right), poses, strict=True)):
        straight, margin = padded(camera)
        size = (WIDTH + 2 * margin, HEIGHT + 2 * margin)
        sensor = mi.load_dict(_sensor(mi, straight, size, pose, view.stand_off))
        linear = np.array(mi.render(loaded, sensor=sensor, seed=view.seed * 10 + k, spp=SAMPLES))[..., 0]
        out.append(_bend(denoise(np.minimum(linear, 60.0)), camera, straight))
    return out[0], out[1]


def _bend(image: Image, camera: Camera, straight: Camera) -> Image:
    """Apply lens distortion by looking up, for every pixel, where its ray falls in the straight picture."""
    if camera is straight:
        return image
    x, y = np.meshgrid(np.arange(WIDTH, dtype=np.float64), np.arange(HEIGHT, dtype=np.float64))
    ray = camera.undistort(np.column_stack([x.ravel(), y.ravel()]))
    u = (straight.focal * ray[:, 0] + straight.centre[0]).reshape(HEIGHT, WIDTH).astype(np.float32)
    v = (straight.focal * ray[:, 1] + straight.centre[1]).reshape(HEIGHT, WIDTH).astype(np.float32)
    if min(u.min(), v.min()) < 1 or u.max() > image.shape[1] - 2 or v.max() > image.shape[0] - 2:
        raise ValueError("the margin is too small for this distortion")
    return np.maximum(cv2.remap(image, u, v, cv2.INTER_LANCZOS4), 0).astype(np.float32)


def denoise(image: Image) -> Image:
    """Open Image Denoise, filter "RT" in HDR mode on the colour alone, by the library in the wheel `oidn`."""
    found = importlib.util.find_spec("oidn")  # its Python layer is not needed and fails to find its own TBB
    if found is None or found.origin is None:
        raise RuntimeError("the package oidn is missing: install the extra `render`")
    folder = Path(found.origin).parent
    ctypes.CDLL(str(next(folder.glob("lib.linux*/libtbb.so*"))), mode=ctypes.RTLD_GLOBAL)
    library = ctypes.CDLL(str(next(folder.glob("lib.linux*/libOpenImageDenoise.so*"))))
    for name in ("oidnNewDevice", "oidnNewFilter"):
        getattr(library, name).restype = ctypes.c_void_p
    device = ctypes.c_void_p(library.oidnNewDevice(0))
    library.oidnCommitDevice(device)
    network = ctypes.c_void_p(library.oidnNewFilter(device, b"RT"))
    colour = np.ascontiguousarray(np.repeat(image[..., None], 3, 2), np.float32)
    output = np.empty_like(colour)
    height, width = image.shape
    no_stride = (ctypes.c_size_t(0),) * 3
    for role, array in ((b"color", colour), (b"output", output)):
        data = array.ctypes.data_as(ctypes.c_void_p)
        size = ctypes.c_size_t(width), ctypes.c_size_t(height)
        library.oidnSetSharedFilterImage(network, role, data, 3, *size, *no_stride)
    library.oidnSetFilter1b(network, b"hdr", ctypes.c_bool(True))
    library.oidnCommitFilter(network)
    library.oidnExecuteFilter(network)
    message = ctypes.c_char_p()
    if library.oidnGetDeviceError(device, ctypes.byref(message)):
        raise RuntimeError(f"denoiser: {message.value!r}")
    return np.asarray(output.mean(2), np.float32)


def expose(
    linear: Image, seed: int, percentile: float, gain: float = 1.0, white: float | None = None
) -> tuple[Any, float]:
    """8-bit picture and the radiance taken as white: PSF of 0.7 px, clipping, shot and read noise, gamma 1/2."""
    rng = np.random.default_rng(seed)
    blurred = cv2.GaussianBlur(linear, (0, 0), 0.7, borderType=cv2.BORDER_REFLECT_101)
    lit = blurred[blurred > 0.02 * np.median(blurred)]
    level = float(np.percentile(lit, percentile)) if white is None else white
    full, read = 7000.0, 7.0
    electrons = rng.poisson(np.minimum(blurred / level * gain, 4.0) * full) + rng.normal(0, read, blurred.shape)
    value = np.clip(electrons / full, 0, 1)
    return np.round(255 * np.sqrt(value)).astype(np.uint8), level
