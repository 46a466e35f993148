"""Which arcs, silhouettes and parts a camera sees from a given pose, by ray casting."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from relmodel.columns import Rows
from vision.cameras.cameras import Camera
from vision.localisation.localisation_parameters import DEFAULTS, LocalisationParameters
from vision.scene.scene import Scene


@dataclass(frozen=True)
class VisibleArcs(Rows):
    """Samples of arcs that a camera sees, as columns: world points and unit tangents, pixels in the camera without
    distortion, px per mm across the line of sight, and the length in the picture that each stands for.

    `arc` counts the scene's arcs first; a silhouette of surface s is arc `len(arc_occurrence) + s`.  `sample` is the
    index of the scene's sample, -1 for a silhouette's.  `normal_a`, `normal_b` (n, 3): of the two faces in the world,
    of a silhouette twice the same.
    """

    point: Floats
    tangent: Floats
    arc: Ints
    sample: Ints
    smooth: Bools
    pixel: Floats
    direction: Floats
    scale: Floats
    length_px: Floats
    normal_a: Floats
    normal_b: Floats


def find_visible_arcs(
    scene: Scene,
    camera: Camera,
    world_from_camera: Floats,
    margin_px: float = 0.0,
    count: int | None = None,
    p: LocalisationParameters = DEFAULTS,
) -> VisibleArcs:
    """The visible samples of the reference's arcs and silhouettes whose pixels lie within `margin_px` of the picture.

    With `count`, only that many of those turned to the camera are looked at, evenly along their images, each of which
    stands for its share of the length.

    A sample is seen when one of its faces is turned to the camera and a ray to the camera is free from a point just off
    the edge: along the sum of the normals (concave edges), or along either (where two solids touch).
    """
    eye = world_from_camera[:3, 3]
    reference = scene.reference_samples
    reference = reference[are_in_picture(scene.sample_point[reference], camera, world_from_camera, margin_px)]
    to_eye = eye - scene.sample_point[reference]
    faces = [np.einsum("ij,ij->i", n[reference], to_eye) > 0 for n in (scene.sample_normal_a, scene.sample_normal_b)]
    # Where one of two smoothly joined faces turns away, their arc is an outline: a facet mesh has no other.
    smooth = (scene.sample_cosine[reference] > np.cos(p.visibility.smooth_angle)) & (faces[0] == faces[1])
    front = faces[0] | faces[1]
    reference, smooth = reference[front], smooth[front]
    spacing = p.search.sample_spacing_px / float(camera.matrix[0, 0])
    outline = find_silhouettes(scene, eye).split(eye, spacing)
    inside = np.flatnonzero(are_in_picture(outline.point, camera, world_from_camera, margin_px))

    point = np.concatenate([scene.sample_point[reference], outline.point[inside]])
    tangent = np.concatenate([scene.sample_tangent[reference], outline.tangent[inside]])
    pixel, direction, along = project_tangents(camera, world_from_camera, point, tangent)
    length = along * np.concatenate([scene.sample_length[reference], outline.length[inside]])
    if count is not None and len(length):
        passed = np.cumsum(length)
        marks = (np.arange(count) + 0.5) * (passed[-1] / count)
        rows, times = np.unique(np.minimum(np.searchsorted(passed, marks), len(passed) - 1), return_counts=True)
        point, tangent, pixel, direction = point[rows], tangent[rows], pixel[rows], direction[rows]
        length = times * (passed[-1] / count)
        of_arcs = np.searchsorted(rows, len(reference))
        inside = inside[rows[of_arcs:] - len(reference)]
        reference, smooth = reference[rows[:of_arcs]], smooth[rows[:of_arcs]]
    none = np.full(len(inside), -1)
    arcs = VisibleArcs(
        point=point,
        tangent=tangent,
        arc=np.concatenate([scene.sample_arc[reference], len(scene.arc_occurrence) + outline.surface[inside]]),
        sample=np.concatenate([reference, none]),
        smooth=np.concatenate([smooth, none > 0]),
        pixel=pixel,
        direction=direction,
        scale=camera.matrix[0, 0] / ((point - eye) @ world_from_camera[:3, 2]),
        length_px=length,
        normal_a=np.concatenate([scene.sample_normal_a[reference], outline.normal[inside]]),
        normal_b=np.concatenate([scene.sample_normal_b[reference], outline.normal[inside]]),
    )
    seen = _free(scene, arcs.point, _unit(arcs.normal_a + arcs.normal_b), eye, p.visibility.ray_offset_mm)
    to_eye = _unit(eye - arcs.point)
    for n in (arcs.normal_a, arcs.normal_b):
        left = np.flatnonzero(~seen & (np.einsum("ij,ij->i", n, to_eye) > 0))
        seen[left] = _free(scene, arcs.point[left], n[left] + 0.5 * to_eye[left], eye, p.visibility.ray_offset_mm)
    return arcs.take(seen)


@dataclass(frozen=True)
class Silhouettes:
    """Segments where curved surfaces turn away from an eye: middles, unit tangents and normals (n, 3), surfaces and
    lengths (n,), a surface's segments together."""

    point: Floats
    tangent: Floats
    normal: Floats
    surface: Ints
    length: Floats

    def split(self, eye: Floats, spacing: float) -> Silhouettes:
        """The segments cut into equal pieces that subtend at most `spacing` (rad) from the eye: a long triangle of a
        cylinder gives a single segment from end to end."""
        distance = np.maximum(np.linalg.norm(self.point - eye, axis=1), self.length)
        pieces = np.ceil(self.length / (spacing * distance)).astype(np.int64)
        row = np.repeat(np.arange(len(pieces)), pieces)
        number = np.arange(len(row)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
        along = ((number + 0.5) / pieces[row] - 0.5) * self.length[row]
        return Silhouettes(
            point=self.point[row] + along[:, None] * self.tangent[row],
            tangent=self.tangent[row],
            normal=self.normal[row],
            surface=self.surface[row],
            length=(self.length / pieces)[row],
        )


def find_silhouettes(scene: Scene, eye: Floats) -> Silhouettes:
    """Where curved, inspected surfaces turn away from the eye: n . v = 0, linear in each triangle's exact normals."""
    rows = scene.curved_triangles
    normal, level = scene.curved_corners
    facing = (normal @ eye - level).reshape(-1, 3)
    positive = facing > 0
    count = positive[:, 0].astype(np.int8) + positive[:, 1] + positive[:, 2]
    mixed = np.flatnonzero((count > 0) & (count < 3))
    corners, normals = scene.vertices[scene.triangles[rows[mixed]]], normal.reshape(-1, 3, 3)[mixed]
    facing, positive = facing[mixed], positive[mixed]
    # The corner that stands alone on its side: both cut sides of the triangle start there.
    apex = np.where(positive.sum(axis=1) == 1, positive.argmax(axis=1), (~positive).argmax(axis=1))
    row = np.arange(len(mixed))
    ends, end_normals = [], []
    for k in (1, 2):
        other = (apex + k) % 3
        a, b = facing[row, apex], facing[row, other]
        s = (a / (a - b))[:, None]
        ends.append(corners[row, apex] * (1 - s) + corners[row, other] * s)
        end_normals.append(normals[row, apex] * (1 - s) + normals[row, other] * s)
    way = ends[1] - ends[0]
    length = np.linalg.norm(way, axis=1)
    surface = scene.triangle_surface[rows[mixed]]
    keep = np.flatnonzero(length > 1e-9)
    order = keep[np.argsort(surface[keep], kind="stable")]
    return Silhouettes(
        point=0.5 * (ends[0] + ends[1])[order],
        tangent=way[order] / length[order, None],
        normal=_unit(end_normals[0] + end_normals[1])[order],
        surface=surface[order],
        length=length[order],
    )


def project_tangents(
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


def are_in_picture(point: Floats, camera: Camera, world_from_camera: Floats, margin_px: float) -> Bools:
    """Which world points (n, 3) lie in front of a camera and within `margin_px` of its picture."""
    low, high = -0.5 - margin_px, (camera.width - 0.5 + margin_px, camera.height - 0.5 + margin_px)
    rotation, eye = world_from_camera[:3, :3], world_from_camera[:3, 3]
    if camera.is_pinhole:
        # Nothing divided, and a row a coordinate: whole models are asked about, from many poses.
        u, v, w = camera.matrix @ rotation.T @ point.T - (camera.matrix @ rotation.T @ eye)[:, None]
        seen = (w > 1e-9) & (u >= low * w) & (u <= high[0] * w) & (v >= low * w) & (v <= high[1] * w)
        return np.asarray(seen)
    uv, front = camera.project((point - eye) @ rotation)
    inside = (uv[:, 0] >= low) & (uv[:, 0] <= high[0]) & (uv[:, 1] >= low) & (uv[:, 1] <= high[1])
    return np.asarray(front & inside)


def _free(scene: Scene, point: Floats, off: Floats, eye: Floats, offset_mm: float) -> Bools:
    return ~scene.rays.blocked(point + offset_mm * off, eye)


def _unit(v: Floats) -> Floats:
    return np.asarray(v / np.maximum(np.linalg.norm(v, axis=-1, keepdims=True), 1e-12))
