"""Surfaces as the renderer takes them: finishes of metal and paint, meshes with lay, printed faces."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from examples.render.model import Component, Part

Array = NDArray[np.float64]
Index = NDArray[np.int64]
TILE_MM, TEXELS = 400.0, 1024


@dataclass(frozen=True)
class Finish:
    """How a machined surface is finished; the default is the demonstration's brushed aluminium.

    GGX roughness along and across the lay, varied by `blotch`; reflectance varied by streaks; a bump map of streaks and
    blotches (mm); tool marks `pitch` mm apart.  A painted surface has the reflectance as its albedo."""

    along: float = 0.115
    across: float = 0.27
    reflectance: float = 0.84
    streak: float = 0.04
    blotch: float = 0.12
    bump_streak: float = 0.003
    bump_blotch: float = 0.013
    pitch: float = 0.0
    bump_pitch: float = 0.0
    lays_deg: tuple[float, ...] = (18.0, 104.0, 63.0, -31.0)
    wall: float = 0.17
    painted: bool = False


def periodic_noise(rng: np.random.Generator, shape: tuple[int, int], along: float, across: float) -> Array:
    """Periodic Gaussian noise of unit deviation, blurred by sigmas in pixels along columns (x) and rows (y)."""
    fy, fx = np.fft.fftfreq(shape[0])[:, None], np.fft.fftfreq(shape[1])[None]
    blur = np.exp(-2 * np.pi**2 * ((along * fx) ** 2 + (across * fy) ** 2))
    field = np.fft.ifft2(np.fft.fft2(rng.normal(size=shape)) * blur).real
    field -= field.mean()
    return np.asarray(field / field.std())


def bitmap(mi: Any, values: Array, wrap: str = "repeat") -> dict[str, Any]:
    data = np.ascontiguousarray(values[..., None], np.float32)
    return {"type": "bitmap", "bitmap": mi.Bitmap(data), "raw": True, "wrap_mode": wrap}


def two_sided(mi: Any, bsdf: dict[str, Any]) -> Any:
    return mi.load_dict({"type": "twosided", "bsdf": bsdf})


def uniform(value: float) -> dict[str, Any]:
    return {"type": "uniform", "value": value}


def metal(name: str, alpha: float, reflectance: float) -> dict[str, Any]:
    """A metal without lay."""
    rough_metal = {"type": "roughconductor", "material": name, "distribution": "ggx", "alpha": alpha}
    return {**rough_metal, "specular_reflectance": uniform(reflectance)}


def paint(albedo: Any, alpha: float) -> dict[str, Any]:
    """A coat of paint or plastic; the albedo is a texture."""
    return {"type": "roughplastic", "distribution": "ggx", "alpha": alpha, "diffuse_reflectance": albedo}


def finished(mi: Any, finish: Finish, rng: np.random.Generator) -> tuple[Any, Any]:
    """BSDFs of flats (with texture coordinates of `TILE_MM`) and of the other faces."""
    shape = (TEXELS, TEXELS)
    streak, blotch = periodic_noise(rng, shape, 90, 0.9), periodic_noise(rng, shape, 45, 30)
    waves = finish.bump_streak * periodic_noise(rng, shape, 120, 1.5)
    waves += finish.bump_blotch * periodic_noise(rng, shape, 40, 25)
    if finish.pitch:
        turns = round(TILE_MM / finish.pitch)
        waves += finish.bump_pitch * np.sin(2 * np.pi * turns * np.arange(TEXELS) / TEXELS)[:, None]
    rough = np.clip(1 + finish.blotch * blotch, 0.7, 1.35)
    if finish.painted:
        albedo = np.clip(finish.reflectance * (1 + finish.streak * streak + 0.5 * finish.blotch * blotch), 0.01, 0.95)
        flat = paint(bitmap(mi, albedo), finish.along)
        wall = paint(uniform(finish.reflectance), finish.wall)
    else:
        flat = {
            "type": "roughconductor",
            "material": "Al",
            "distribution": "ggx",
            "alpha_u": bitmap(mi, finish.along * rough),
            "alpha_v": bitmap(mi, finish.across * rough),
            "specular_reflectance": bitmap(
                mi, np.clip(finish.reflectance + finish.streak * streak, 0.7 * finish.reflectance, 1.0)
            ),
        }
        wall = metal("Al", finish.wall, finish.reflectance)
    bumped = {"type": "bumpmap", "arbitrary": bitmap(mi, waves), "bsdf": flat}
    return two_sided(mi, bumped), two_sided(mi, wall)


def mesh(mi: Any, name: str, vertices: Array, normals: Array, triangles: Index, uv: Array | None, bsdf: Any) -> Any:
    """A mesh of the renderer with exact normals at its vertices."""
    properties = mi.Properties()
    properties["mesh_bsdf"] = bsdf
    out = mi.Mesh(name, len(vertices), len(triangles), properties, True, uv is not None)
    parameters = mi.traverse(out)
    parameters["vertex_positions"] = np.ravel(vertices).astype(np.float32)
    parameters["vertex_normals"] = np.ravel(normals).astype(np.float32)
    parameters["faces"] = np.ravel(triangles).astype(np.uint32)
    if uv is not None:
        parameters["vertex_texcoords"] = np.ravel(uv).astype(np.float32)
    parameters.update()
    return out


def _placed(component: Component) -> tuple[Array, Array]:
    place = component.object_from_part
    vertices = component.part.vertices @ place[:3, :3].T + place[:3, 3]
    return vertices, component.part.normals @ place[:3, :3].T


def _select(triangles: Index, keep: NDArray[np.bool_]) -> tuple[Index, Index]:
    """Vertex numbers and renumbered triangles of the triangles whose vertices are kept."""
    wanted = triangles[keep[triangles[:, 0]]]
    used, inverse = np.unique(wanted, return_inverse=True)
    return used, inverse.reshape(-1, 3)


def bulkhead_meshes(mi: Any, components: list[Component], finish: Finish, rng: np.random.Generator) -> dict[str, Any]:
    """The body in two meshes (flats with lay, walls without) and each other component in one."""
    flat_bsdf, wall_bsdf = finished(mi, finish, rng)
    fittings = {
        "BUSHING_25": metal("Cu", 0.18, 0.9),
        "BOLT_M8": metal("Cr", 0.28, 0.8),
        "CLIP": metal("Al", 0.32, 0.45),
        "PLUG": paint(uniform(0.12), 0.3),
    }
    bsdfs = {product: two_sided(mi, bsdf) for product, bsdf in fittings.items()}
    lays = np.radians(np.array(finish.lays_deg))
    out = {}
    for number, component in enumerate(components):
        part = component.part
        vertices, normals = _placed(component)
        if part.name != "BULKHEAD_BODY":
            out[f"part_{number}"] = mesh(mi, component.path, vertices, normals, part.triangles, None, bsdfs[part.name])
            continue
        flat = np.abs(part.normals[:, 2]) > 0.999
        # One lay a face, picked by the face's level and number; the long rims keep one lay.
        lay = lays[(part.face * 7 + part.face // 5) % len(lays)]
        c, s = np.cos(lay), np.sin(lay)
        x, y = vertices[:, 0], vertices[:, 1]
        uv = np.column_stack([c * x + s * y, -s * x + c * y]) / TILE_MM + (part.face * 0.37)[:, None] % 1.0
        for label, keep, bsdf in (("flat", flat, flat_bsdf), ("wall", ~flat, wall_bsdf)):
            used, triangles = _select(part.triangles, keep)
            mesh_uv = uv[used] if label == "flat" else None
            out[f"body_{label}"] = mesh(mi, label, vertices[used], normals[used], triangles, mesh_uv, bsdf)
    return out


def plane_faces(part: Part) -> dict[int, tuple[Index, Array, Array]]:
    """Of every plane face: its vertices, its normal (3,), and coordinates (n, 2) in its plane from its lower left, mm.

    The first axis lies along the plate of an upright face; seen from outside, coordinates are not mirrored."""
    out = {}
    for number in np.unique(part.face):
        of_face = np.flatnonzero(part.face == number)
        normal = part.normals[of_face[0]]
        if (part.normals[of_face] @ normal).min() < 0.9999:
            continue
        along = np.cross([0, 0, 1.0], normal) if abs(normal[2]) < 0.99 else np.array([1.0, 0, 0])
        along /= np.linalg.norm(along)
        axes = np.array([along, np.cross(normal, along)])
        flat = part.vertices[of_face] @ axes.T
        out[int(number)] = of_face, normal, flat - flat.min(0)
    return out


def finished_meshes(
    mi: Any, components: list[Component], finishes: list[Finish], rng: np.random.Generator
) -> dict[str, Any]:
    """Small parts, each with its finish: plane faces with a lay of their own, the others without."""
    ready = {finish: finished(mi, finish, rng) for finish in dict.fromkeys(finishes)}
    out = {}
    for number, (component, finish) in enumerate(zip(components, finishes, strict=True)):
        part, (vertices, normals) = component.part, _placed(component)
        uv, plane = np.zeros((len(vertices), 2)), np.zeros(len(vertices), bool)
        for face, (of_face, _, flat) in plane_faces(part).items():
            lay = np.radians(finish.lays_deg[face % len(finish.lays_deg)])
            turn = np.array([[np.cos(lay), np.sin(lay)], [-np.sin(lay), np.cos(lay)]])
            uv[of_face] = flat @ turn.T / TILE_MM + 0.37 * (face + 3 * number) % 1.0
            plane[of_face] = True
        for label, keep, bsdf in (("flat", plane, ready[finish][0]), ("round", ~plane, ready[finish][1])):
            used, triangles = _select(part.triangles, keep)
            if len(used):
                mesh_uv = uv[used] if label == "flat" else None
                out[f"part_{number}_{label}"] = mesh(mi, label, vertices[used], normals[used], triangles, mesh_uv, bsdf)
    return out


def printed_meshes(
    mi: Any, components: list[Component], prints: dict[tuple[int, int], Array], gloss: float
) -> dict[str, Any]:
    """Cartons: every plane face with its own print, albedo (rows from the top) by component and face number."""
    out = {}
    for number, component in enumerate(components):
        part, (vertices, normals) = component.part, _placed(component)
        for face, (of_face, _, flat) in plane_faces(part).items():
            keep = np.zeros(len(vertices), bool)
            keep[of_face] = True
            used, triangles = _select(part.triangles, keep)
            uv = np.zeros((len(vertices), 2))
            uv[of_face] = flat / flat.max(0)
            print_bsdf = two_sided(mi, paint(bitmap(mi, prints[number, face], "clamp"), gloss))
            out[f"part_{number}_{face}"] = mesh(
                mi, f"{component.path}_{face}", vertices[used], normals[used], triangles, uv[used], print_bsdf
            )
    return out
