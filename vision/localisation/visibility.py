"""Which arcs, silhouettes and parts a camera sees from a given pose, by ray casting."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from vision.cameras import Camera
from vision.localisation.scene import Bools, Floats, Ints, Scene

# How far a ray starts off the surface; at a tessellation of 0.05 mm this agrees with exact hidden-line removal.
RAY_OFFSET_MM = 0.1


@dataclass(frozen=True)
class VisibleArcs:
    """Samples of arcs that a camera sees, as columns: world points and unit tangents, pixels in the camera without
    distortion, and the length in the picture that each stands for.

    `arc` counts the scene's arcs first; a silhouette of surface s is arc `len(arc_occurrence) + s`.  `sample` is the
    index of the scene's sample, -1 for a silhouette's.
    """

    point: Floats
    tangent: Floats
    arc: Ints
    sample: Ints
    smooth: Bools
    pixel: Floats
    direction: Floats
    length_px: Floats

    def take(self, rows: Ints | Bools) -> VisibleArcs:
        return VisibleArcs(*(getattr(self, name)[rows] for name in self.__dataclass_fields__))


def visible_arcs(scene: Scene, camera: Camera, world_from_camera: Floats, margin_px: float = 0.0) -> VisibleArcs:
    """The visible samples of the reference's arcs and silhouettes whose pixels lie within `margin_px` of the picture.

    A sample is seen when one of its faces is turned to the camera and a ray to the camera is free from a point just off
    the edge: along the sum of the normals (concave edges), or along either (where two solids touch).
    """
    eye = world_from_camera[:3, 3]
    reference = np.flatnonzero(scene.sample_is_reference)
    reference = reference[_in_picture(scene.sample_point[reference], camera, world_from_camera, margin_px)]
    to_eye = eye - scene.sample_point[reference]
    to_eye /= np.linalg.norm(to_eye, axis=1)[:, None]
    normals = [scene.sample_normal_a[reference], scene.sample_normal_b[reference]]
    faces = [np.einsum("ij,ij->i", n, to_eye) > 0 for n in normals]
    front = faces[0] | faces[1]
    reference, to_eye = reference[front], to_eye[front]
    normals, faces = [n[front] for n in normals], [f[front] for f in faces]
    seen = _free(scene, scene.sample_point[reference], _unit(normals[0] + normals[1]), eye)
    for normal, face in zip(normals, faces, strict=True):
        left = np.flatnonzero(~seen & face)
        seen[left] = _free(scene, scene.sample_point[reference[left]], normal[left] + 0.5 * to_eye[left], eye)
    reference = reference[seen]

    middle, tangent, surface, normal, length = silhouettes(scene, eye)
    inside = np.flatnonzero(_in_picture(middle, camera, world_from_camera, margin_px))
    inside = inside[_free(scene, middle[inside], normal[inside], eye)]
    point = np.concatenate([scene.sample_point[reference], middle[inside]])
    direction3 = np.concatenate([scene.sample_tangent[reference], tangent[inside]])
    length_mm = np.concatenate([scene.sample_length[reference], length[inside]])
    pixel, direction, scale = project_directions(camera, world_from_camera, point, direction3)
    return VisibleArcs(
        point=point,
        tangent=direction3,
        arc=np.concatenate([scene.sample_arc[reference], len(scene.arc_occurrence) + surface[inside]]),
        sample=np.concatenate([reference, np.full(len(inside), -1)]),
        smooth=np.concatenate([scene.sample_smooth[reference], np.zeros(len(inside), bool)]),
        pixel=pixel,
        direction=direction,
        length_px=scale * length_mm,
    )


def silhouettes(scene: Scene, eye: Floats) -> tuple[Floats, Floats, Ints, Floats, Floats]:
    """Segments where curved surfaces turn away from the eye: n . v = 0, linear in each triangle's exact normals.

    Returns the middles (n, 3), unit tangents (n, 3), surfaces (n,), unit normals (n, 3) and lengths (n,).
    """
    rows = scene.curved_triangles
    corners = scene.vertices[scene.triangles[rows]]
    normals = scene.vertex_normals[scene.triangles[rows]]
    facing = np.einsum("fij,fij->fi", normals, eye - corners)
    positive = facing > 0
    mixed = np.flatnonzero(positive.any(axis=1) & ~positive.all(axis=1))
    corners, normals, facing, positive = corners[mixed], normals[mixed], facing[mixed], positive[mixed]
    # The corner that stands alone on its side: both cut sides of the triangle start there.
    alone = np.where(positive.sum(axis=1) == 1, positive.argmax(axis=1), (~positive).argmax(axis=1))
    row = np.arange(len(mixed))
    ends, end_normals = [], []
    for k in (1, 2):
        other = (alone + k) % 3
        a, b = facing[row, alone], facing[row, other]
        s = (a / (a - b))[:, None]
        ends.append(corners[row, alone] * (1 - s) + corners[row, other] * s)
        end_normals.append(normals[row, alone] * (1 - s) + normals[row, other] * s)
    way = ends[1] - ends[0]
    length = np.linalg.norm(way, axis=1)
    surface = scene.triangle_surface[rows[mixed]]
    keep = np.flatnonzero(length > 1e-9)
    order = keep[np.argsort(surface[keep], kind="stable")]
    return (
        0.5 * (ends[0] + ends[1])[order],
        way[order] / length[order, None],
        surface[order],
        _unit(end_normals[0] + end_normals[1])[order],
        length[order],
    )


def project_directions(
    camera: Camera, world_from_camera: Floats, point: Floats, tangent: Floats
) -> tuple[Floats, Floats, Floats]:
    """Pixels (n, 2) in the camera without distortion, unit image directions (n, 2) and px per mm along them (n,)."""
    rotation = world_from_camera[:3, :3]
    p = (point - world_from_camera[:3, 3]) @ rotation
    t = tangent @ rotation
    k = camera.matrix[:2, :2]
    xy = p[:, :2] / p[:, 2:]
    flow = (t[:, :2] - xy * t[:, 2:]) / p[:, 2:] @ k.T
    scale = np.linalg.norm(flow, axis=1)
    direction = flow / np.maximum(scale, 1e-12)[:, None]
    return xy @ k.T + camera.matrix[:2, 2], direction, scale


def _in_picture(point: Floats, camera: Camera, world_from_camera: Floats, margin_px: float) -> Bools:
    p = (point - world_from_camera[:3, 3]) @ world_from_camera[:3, :3]
    uv, front = camera.project(p)
    low, high = -0.5 - margin_px, np.array([camera.width, camera.height]) - 0.5 + margin_px
    return np.asarray(front & ((uv >= low) & (uv <= high)).all(axis=1))


def _free(scene: Scene, point: Floats, off: Floats, eye: Floats) -> Bools:
    return ~scene.rays.blocked(point + RAY_OFFSET_MM * off, eye)


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12))
