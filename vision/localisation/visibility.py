"""What cameras see at a pose: which arcs, silhouettes, parts and features, and how much of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from math import radians

import numpy as np

from relmodel.arrays import Bools, Floats, Ints, Rows, count_from
from vision.cameras.cameras import Camera, Rig
from vision.scene import Scene, StoredScene

# Pixels are those of the camera without distortion.  Values without a named source, here and in the other modules of
# localisation, were chosen on rendered bulkheads with exact truth.
RAY_OFFSET_MM = 0.1  # off the surface where a ray starts: with a tessellation of 0.05 mm as exact hidden lines
SMOOTH_ANGLE = radians(20)  # faces that meet at less are smoothly joined: a blend, which shows as shading, no edge
SAMPLE_SPACING_PX = 4.0  # px between the samples that are kept for the search
COVERAGE_STEP_PX = 3  # side of the square that a ray stands for; shares of parts of 400 px are good to about 5 %
COVERAGE_NEAR_MM = 1.0  # before the camera: triangles that reach nearer are tested against every ray


@dataclass(frozen=True)
class VisibleArcs(Rows):
    """Samples of arcs that a camera sees, as columns: world points and unit tangents, pixels in the camera without
    distortion, px per mm across the line of sight, and the length in the picture that each stands for.

    `arc` counts the scene's arcs first; a silhouette of surface s is arc `len(arc_occurrence) + s`.  `sample` is the
    index of the scene's sample, -1 for a silhouette's.  `normal_a`, `normal_b` (n, 3): of the two faces in the world,
    of a silhouette twice the same."""

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
    scene: Scene, camera: Camera, world_from_camera: Floats, margin_px: float = 0.0, count: int | None = None
) -> VisibleArcs:
    """The visible samples of the reference's arcs and silhouettes whose pixels lie within `margin_px` of the picture.

    With `count`, only that many of those turned to the camera are looked at, evenly along their images, each of which
    stands for its share of the length.

    A sample is seen when one of its faces is turned to the camera and a ray to the camera is free from a point just off
    the edge: along the sum of the normals (concave edges), or along either (where two solids touch)."""
    eye = world_from_camera[:3, 3]
    reference = scene.reference_samples
    reference = reference[are_in_picture(scene.sample_point[reference], camera, world_from_camera, margin_px)]
    to_eye = eye - scene.sample_point[reference]
    faces = [np.einsum("ij,ij->i", n[reference], to_eye) > 0 for n in (scene.sample_normal_a, scene.sample_normal_b)]
    # Where one of two smoothly joined faces turns away, their arc is an outline: a facet mesh has no other.
    smooth = (scene.sample_cosine[reference] > np.cos(SMOOTH_ANGLE)) & (faces[0] == faces[1])
    front = faces[0] | faces[1]
    reference, smooth = reference[front], smooth[front]
    spacing = SAMPLE_SPACING_PX / float(camera.matrix[0, 0])
    outline = find_silhouettes(scene, eye).split(eye, spacing)
    inside = np.flatnonzero(are_in_picture(outline.point, camera, world_from_camera, margin_px))

    point = np.concatenate([scene.sample_point[reference], outline.point[inside]])
    tangent = np.concatenate([scene.sample_tangent[reference], outline.tangent[inside]])
    pixel, direction, along = project_tangents(camera, world_from_camera, point, tangent)
    length = along * np.concatenate([scene.sample_length[reference], outline.length[inside]])
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
    if count is not None and len(length):
        passed = np.cumsum(length)
        marks = (np.arange(count) + 0.5) * (passed[-1] / count)
        rows, times = np.unique(np.minimum(np.searchsorted(passed, marks), len(passed) - 1), return_counts=True)
        arcs = replace(arcs.take(rows), length_px=times * (passed[-1] / count))
    seen = _free(scene, arcs.point, _unit(arcs.normal_a + arcs.normal_b), eye, RAY_OFFSET_MM)
    to_eye = _unit(eye - arcs.point)
    for n in (arcs.normal_a, arcs.normal_b):
        left = np.flatnonzero(~seen & (np.einsum("ij,ij->i", n, to_eye) > 0))
        seen[left] = _free(scene, arcs.point[left], n[left] + 0.5 * to_eye[left], eye, RAY_OFFSET_MM)
    return arcs.take(seen)


@dataclass(frozen=True)
class Silhouettes(Rows):
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
        row, number = count_from(np.zeros_like(pieces), pieces)
        along = ((number + 0.5) / pieces[row] - 0.5) * self.length[row]
        found = self.take(row)
        return replace(found, point=found.point + along[:, None] * found.tangent, length=(self.length / pieces)[row])


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


# How much of each part and feature a camera sees: pixels shown, and pixels covered were nothing before it.

_LEAST_DEPTH = 1e-6  # mm: no surface is seen nearer


def measure_coverage(
    scene: Scene, seen: SurfaceMap, world_from_camera: Floats, group: Ints, surface: Ints, group_count: int
) -> tuple[Floats, Floats]:
    """Pixels of each group of surfaces (g,) in what a camera sees at a pose: visible in the picture, and covered if all
    else were away; `group[i]` contains `surface[i]`, a surface may be in several groups."""
    from vision.localisation import kernels

    rays, visible = seen.rays, seen.count_pixels(len(scene.surface_occurrence))
    camera_from_world = np.linalg.inv(world_from_camera)
    corners = scene.vertices @ camera_from_world[:3, :3].T + camera_from_world[:3, 3]
    order = np.argsort(group, kind="stable")
    triangle_order = np.argsort(scene.triangle_surface, kind="stable")
    boxes, sides = _triangles(rays, corners, scene.triangles[triangle_order])
    covered = np.zeros(group_count)
    kernels.covered(
        rays.directions,
        rays.weight,
        boxes,
        sides,
        np.searchsorted(scene.triangle_surface[triangle_order], np.arange(len(scene.surface_occurrence) + 1)),
        np.asarray(surface[order], np.int64),
        np.searchsorted(group[order], np.arange(group_count + 1)),
        np.zeros(rays.weight.shape, np.int64),
        covered,
    )
    return np.bincount(group, visible[surface], group_count).astype(float), covered


@dataclass(frozen=True)
class RayGrid:
    """Rays of a camera on a regular grid of the picture that it would give without distortion.

    directions (rows, columns, 3) in the camera's frame, z = 1; pixel (rows, columns, 2): the place in the real picture;
    weight (rows, columns): the area of the real picture that each stands for, px, zero outside it; matrix (3, 3) from
    directions to cells (x, y) of the grid; step: px from one to the next."""

    directions: Floats
    pixel: Floats
    weight: Floats
    matrix: Floats
    step: int

    def cells(self, points: Floats) -> Floats:
        """Cells (n, 2) of points (n, 3) before the camera."""
        return np.asarray((points / points[:, 2:] @ self.matrix.T)[:, :2])


def _triangles(rays: RayGrid, corners: Floats, triangles: Ints) -> tuple[Ints, Floats]:
    """Boxes (t, 4) of the cells that triangles may cover, none for one turned away or behind, and their sides (t, 9).

    A ray d meets the triangle (a, b, c), counter-clockwise from outside, where d . (a x b), d . (b x c) and d . (c x a)
    are negative; that needs no clipping at the camera's plane."""
    last = np.array(rays.weight.shape[::-1]) - 1.0
    front = corners[:, 2] > COVERAGE_NEAR_MM
    cells = np.zeros((len(corners), 2))
    cells[front] = rays.cells(corners[front])
    of_corners = cells[triangles]
    lowest, highest = of_corners.min(axis=1), of_corners.max(axis=1)
    near = np.flatnonzero(~front[triangles].all(axis=1))
    lowest[near], highest[near] = _bound_before(rays, corners[triangles[near]])
    # Corners far beside the picture overflow an integer: they are clipped first.
    low = np.ceil(np.clip(lowest, 0, 1e6))
    high = np.floor(np.clip(highest, -1, last))
    a, b, c = (corners[triangles[:, i]] for i in range(3))
    sides = np.hstack([np.cross(a, b), np.cross(b, c), np.cross(c, a)])
    behind = (corners[triangles, 2] <= 0).all(axis=1)
    volume = a[:, 0] * sides[:, 3] + a[:, 1] * sides[:, 4] + a[:, 2] * sides[:, 5]
    high[behind | (volume >= 0)] = -1  # a surface is seen from outside only
    boxes = np.stack([low[:, 0], high[:, 0], low[:, 1], high[:, 1]], axis=1)
    return boxes.astype(np.int64), sides


def _bound_before(rays: RayGrid, corners: Floats) -> tuple[Floats, Floats]:
    """Bounds (t, 2) of the cells that the parts of triangles (t, 3, 3) before the camera cover."""
    following = np.roll(corners, -1, axis=1)
    depth, after = corners[..., 2:], following[..., 2:]
    with np.errstate(divide="ignore", invalid="ignore"):
        crossing = corners + (_LEAST_DEPTH - depth) / (after - depth) * (following - corners)
        crossing[..., 2] = _LEAST_DEPTH
        points = np.concatenate([corners, crossing], axis=1)
        cells = rays.cells(points.reshape(-1, 3)).reshape(len(corners), 6, 2)
    ahead = corners[..., 2] > _LEAST_DEPTH
    used = np.concatenate([ahead, ahead != np.roll(ahead, -1, axis=1)], axis=1)[..., None]
    return np.where(used, cells, np.inf).min(axis=1), np.where(used, cells, -np.inf).max(axis=1)


def lay_rays(camera: Camera, step: int) -> RayGrid:
    """A ray for each square of `step` px of the picture that the camera would give without distortion."""
    width, height, matrix = camera.undistorted_view()
    x, y = np.arange(0.5 * (step - 1), width, step), np.arange(0.5 * (step - 1), height, step)
    pixels = np.stack([*np.meshgrid(x, y), np.ones((len(y), len(x)))], axis=-1)
    directions = np.ascontiguousarray(pixels @ np.linalg.inv(matrix).T, dtype=np.float64)
    real, front = camera.project(directions.reshape(-1, 3))
    inside = front & ((real >= -0.5) & (real <= np.array([camera.width, camera.height]) - 0.5)).all(axis=1)
    to_cells = np.asarray(np.diag([1 / step, 1 / step, 1.0]) @ matrix, float)
    to_cells[:2, 2] -= 0.5 * (step - 1) / step
    weight = np.where(inside, float(step**2), 0.0).reshape(len(y), len(x))
    return RayGrid(directions, real.reshape(len(y), len(x), 2), weight, to_cells, step)


@dataclass(frozen=True)
class SurfaceMap:
    """Which surface of the scene each place of a picture shows (rows, columns), -1 for none, on the grid of `rays`, at
    a pose of the camera."""

    camera: Camera
    rays: RayGrid
    surface: Ints
    world_from_camera: Floats

    def count_pixels(self, surfaces: int) -> Floats:
        """Pixels (s,) of the picture that show each surface of the scene."""
        shown = self.surface >= 0
        return np.bincount(self.surface[shown], self.rays.weight[shown], surfaces).astype(float)

    def surface_at(self, pixel: Floats) -> Ints:
        """The surface (n,) at pixels (n, 2) of the real picture; -1 for none, and outside."""
        return self.value_along(self.surface, self.camera.normalise(self.camera.undistort(pixel)), -1)

    def value_along(self, values: Ints, xy: Floats, outside: int) -> Ints:
        """What values (rows, columns) on the grid are (n,) along rays through xy (n, 2) at depth one."""
        x, y = np.rint(xy @ self.rays.matrix[:2, :2].T + self.rays.matrix[:2, 2]).astype(np.int64).T
        rows, columns = self.surface.shape
        inside = (x >= 0) & (x < columns) & (y >= 0) & (y < rows)
        return np.where(inside, values[np.where(inside, y, 0), np.where(inside, x, 0)], outside)


def map_surfaces(scene: Scene, camera: Camera, world_from_camera: Floats) -> SurfaceMap:
    """The surfaces that a camera sees at a pose."""
    rays = lay_rays(camera, COVERAGE_STEP_PX)
    surface, used = np.full(rays.weight.shape, -1, np.int64), rays.weight > 0
    surface[used] = trace_surfaces(scene, world_from_camera, rays.directions[used])
    return SurfaceMap(camera, rays, surface, world_from_camera)


def trace_surfaces(scene: Scene, world_from_camera: Floats, directions: Floats) -> Ints:
    """The surface (n,) that each ray (n, 3) of a camera meets first, -1 for none."""
    hit = scene.rays.nearest(world_from_camera[:3, 3], directions @ world_from_camera[:3, :3].T)
    return np.where(hit >= 0, scene.triangle_surface[hit], -1)


# Which placed parts and features the cameras see at a pose, and which share of each.

PART = -1  # feature number of a part as a whole


@dataclass(frozen=True)
class PartsInView:
    """Columns, one row a part or feature that some camera shows; feature_no is PART for parts as a whole.

    visible, covered: pixels over all cameras, shown and covered were nothing before it."""

    occurrence_id: Ints
    feature_no: Ints
    path: list[str]
    visible: Floats
    covered: Floats

    @property
    def level(self) -> list[str]:
        return ["part" if number == PART else "feature" for number in self.feature_no]


def find_parts_in_view(
    stored: StoredScene, rig: Rig, maps: Mapping[str, SurfaceMap], world_from_rig: Floats
) -> PartsInView:
    """What the cameras of a rig see at a pose (maps, by camera), parts first, each kind in the order of occurrences."""
    scene = stored.scene
    occurrences = len(stored.occurrence_id)
    occurrence, feature, paths = list(range(occurrences)), [PART] * occurrences, list(stored.paths)
    group, surface = [scene.surface_occurrence], [np.arange(len(scene.surface_occurrence))]

    rows = stored.features
    by_key = {
        (int(o), int(n)): s for s, (o, n) in enumerate(zip(scene.surface_occurrence, stored.surface_no, strict=True))
    }
    for placed, shape in enumerate(stored.shape_id.tolist()):
        mine = rows["shape_id"] == shape
        numbers, first = np.unique(rows["feature_no"][mine], return_index=True)
        names = rows["name"][mine][first]
        paths += [f"{stored.paths[placed]}/{name}" for name in names]
        occurrence += [placed] * len(numbers)
        feature += numbers.tolist()
        at = len(paths) - len(numbers)
        group.append(at + np.searchsorted(numbers, rows["feature_no"][mine]))
        surface.append(np.array([by_key[placed, int(n)] for n in rows["surface_no"][mine]], np.int64))
    groups, surfaces = np.concatenate(group), np.concatenate(surface)
    visible, covered = np.zeros(len(paths)), np.zeros(len(paths))
    for name in rig.cameras:
        found = measure_coverage(
            scene, maps[name], world_from_rig @ rig.rig_from_camera[name], groups, surfaces, len(paths)
        )
        visible += found[0]
        covered += found[1]
    # Rays through the middles of squares may hit where no square's middle is covered: sharp outlines, by a ray or two.
    covered = np.maximum(covered, visible)
    seen = np.flatnonzero(visible > 0)
    whose, feature_no = stored.occurrence_id[np.array(occurrence)[seen]], np.array(feature)[seen]
    return PartsInView(whose, feature_no, [paths[i] for i in seen], visible[seen], covered[seen])
