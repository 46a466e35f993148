"""Photoreal grey pictures with Mitsuba 3 (`llvm_ad_mono`), denoised with OIDN, and a sensor model.

All in the object's frame.  Needs the extra `render`, libLLVM (its full path in DRJIT_LIBLLVM_PATH) and a few minutes.
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

from examples.render.truth import pixel_rays
from examples.render.views import Camera, Shot

Array = NDArray[np.float64]
Image = NDArray[np.float32]


def renderer() -> Any:
    """The renderer's module, grey and on all cores."""
    import mitsuba as mi

    mi.set_variant("llvm_ad_mono")
    return mi


def render(
    mi: Any, scene: dict[str, Any], view: Shot, samples: int, seed: int, aperture: float = 1.3
) -> dict[str, Image]:
    """Linear pictures of all cameras (lens distortion applied), noise-free but for what the denoiser leaves.

    `scene` holds meshes and lamps by name; `samples` are rays a pixel, `aperture` the lens's radius in mm."""
    loaded = mi.load_dict({"type": "scene", "integrator": {"type": "path", "max_depth": 5}, **scene})
    out = {}
    for k, (side, camera) in enumerate(view.cameras.items()):
        straight = padded(camera)
        sensor = mi.load_dict(_sensor(mi, straight, view.poses[side], view.stand_off, samples, aperture))
        linear = np.array(mi.render(loaded, sensor=sensor, seed=seed * 10 + k, spp=samples))[..., 0]
        out[side] = _bend(denoise(np.minimum(linear, 60.0)), camera, straight)
    return out


def padded(camera: Camera, margin: int = 72) -> Camera:
    """A camera without distortion that sees all that `camera` sees: a margin in pixels on every side."""
    if not any(camera.distortion):
        return camera
    (x, y), (width, height) = camera.centre, camera.size
    wider = (width + 2 * margin, height + 2 * margin)
    return Camera(camera.focal, (x + margin, y + margin), size=wider)


def _sensor(mi: Any, camera: Camera, pose: Array, focus: float, samples: int, aperture: float) -> dict[str, Any]:
    """A thin lens whose crop window of a larger film puts the principal point where it belongs."""
    film, offset = [], []
    for pixels, centre in zip(camera.size, camera.centre, strict=True):
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
        "aperture_radius": aperture,
        "focus_distance": focus,
        "near_clip": 10.0,
        "far_clip": 1e5,
        "to_world": mi.ScalarTransform4f(pose @ flip),
        "film": {
            "type": "hdrfilm",
            "width": film[0],
            "height": film[1],
            "crop_width": camera.size[0],
            "crop_height": camera.size[1],
            "crop_offset_x": offset[0],
            "crop_offset_y": offset[1],
            "pixel_format": "luminance",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
        "sampler": {"type": "multijitter", "sample_count": samples},
    }


def _bend(image: Image, camera: Camera, straight: Camera) -> Image:
    """Apply lens distortion by looking up, for every pixel, where its ray falls in the straight picture."""
    if camera is straight:
        return image
    at = (straight.focal * pixel_rays(camera)[:, :2] + straight.centre).astype(np.float32)
    u, v = at.T.reshape(2, *camera.size[::-1])
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
    library.oidnReleaseFilter(network)  # some hundred megabytes
    library.oidnReleaseDevice(device)
    return np.asarray(output.mean(2), np.float32)


def expose(
    linear: Image,
    seed: int,
    percentile: float,
    gain: float = 1.0,
    white: float | None = None,
    full: float = 7000.0,
    read: float = 7.0,
    ev: float = 0.0,
    blur: float = 0.7,
    gamma: float = 0.5,
) -> tuple[Any, float]:
    """8-bit picture and the radiance taken as white: PSF of `blur` px, clipping, shot and read noise, exponent `gamma`.

    `full` electrons are white, `read` of them the readout's noise; `ev` doublings brighter than the percentile says."""
    rng = np.random.default_rng(seed)
    blurred = cv2.GaussianBlur(linear, (0, 0), blur, borderType=cv2.BORDER_REFLECT_101)
    lit = blurred[blurred > 0.02 * np.median(blurred)]
    level = float(np.percentile(lit, percentile)) / 2**ev if white is None else white
    electrons = rng.poisson(np.minimum(blurred / level * gain, 4.0) * full) + rng.normal(0, read, blurred.shape)
    value = np.clip(electrons / full, 0, 1)
    return np.round(255 * value**gamma).astype(np.uint8), level
