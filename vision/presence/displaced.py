"""Parts that lie beside their place: by how much in their plane, out of it, and turned about its normal.

A part, or an assembly of parts that stand together, is moved as one piece until the edges predicted of it lie on those
of the pictures: least squares with a robust loss over all cameras, from its place and from places around it.  The pose
is held: what shows much of the view is what the pose was found by, and is left out.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from relmodel.arrays import Bools, Floats, Ints
from vision.cameras.cameras import Rig
from vision.localisation.measurements import EdgeIndex
from vision.localisation.scene import Scene
from vision.localisation.stored_scene import StoredScene
from vision.presence.items import Items
from vision.presence.measures import Measures
from vision.presence.parameters import DisplacedParameters
from vision.presence.samples import Beside, Samples
from vision.presence.support import Support

NEAREST = 6  # elements looked at beside a sample: more lie within a few px only in dense texture
BESIDE_PX = 1.0  # along the edge, between a sample and the element on its normal
MIN_COSINE = np.cos(np.radians(20))  # of the angle between their normals


@dataclass(frozen=True)
class Displacements:
    """Where the edges of parts were found best, as columns: occurrence: the scene's; shift (n, 3), shift_sigma (n, 3):
    mm in the world, from where the model has it, and standard deviations; distance, sigma: mm, how far that is, and
    its standard deviation; turn, turn_sigma: rad about the normal of the part's plane; log_odds: of lying there against
    lying in place; moved: whether it surely lies there."""

    occurrence: Ints
    shift: Floats
    shift_sigma: Floats
    distance: Floats
    sigma: Floats
    turn: Floats
    turn_sigma: Floats
    log_odds: Floats
    moved: Bools


def measure_displacements(
    stored: StoredScene,
    rig: Rig,
    world_from_rig: Floats,
    indexes: list[EdgeIndex],
    samples: Samples,
    beside: Beside,
    support: Support,
    p: DisplacedParameters,
) -> Displacements:
    """Where the parts lie that show enough edges, and not so many that the pose is found by them."""
    scene = stored.scene
    piece_of = find_pieces(stored.paths)
    count = int(piece_of.max(initial=-1)) + 1
    of_sample = piece_of[scene.surface_occurrence[samples.surface[:, 0]]]
    shown = np.bincount(of_sample, support.weight, count)
    inspected = np.isin(np.arange(count), piece_of[scene.inspected])
    tried = np.flatnonzero(inspected & (shown >= p.least_px) & (shown <= p.most_share * shown.sum()))
    owner = _own_elements(beside, support, of_sample, sum(len(index.edges.position) for index in indexes))
    cameras = _list_cameras(rig, world_from_rig, indexes)
    found: list[tuple[int, _Place]] = []
    for piece in tried.tolist():
        rows = np.flatnonzero((of_sample == piece) & (support.weight > 0))
        views = _list_views(samples.take(rows), support.weight[rows], cameras, (owner < 0) | (owner == piece))
        chance = float(np.average(support.chance[rows], weights=support.weight[rows]))
        members = np.flatnonzero(piece_of == piece)
        centre = np.average(samples.point[rows], axis=0, weights=support.weight[rows])
        place = _locate(views, centre, _find_axes(scene, members), chance, p)
        found += [(occurrence, place) for occurrence in members.tolist()]
    return _gather(found)


def find_pieces(paths: Sequence[str]) -> Ints:
    """The piece (o,) that each occurrence belongs to: the parts of an assembly within an object are one piece."""
    above = [path.rpartition("/")[0] for path in paths]
    pieces = [group if "/" in group else path for path, group in zip(paths, above, strict=True)]
    return np.asarray(np.unique(pieces, return_inverse=True)[1].ravel(), np.int64)


def _own_elements(beside: Beside, support: Support, of_sample: Ints, count: int) -> Ints:
    """The piece (e,) whose predicted edge takes each element, -1 for none."""
    taken = np.full(count, -1)
    rows = np.flatnonzero(support.owner >= 0)
    taken[beside.element[rows]] = of_sample[support.owner[rows]]
    return taken


def _find_axes(scene: Scene, occurrences: Ints) -> Floats:
    """Unit vectors (3, 3): two along the plane that most of the surface of parts is parallel to, and its normal."""
    mine = np.isin(scene.surface_occurrence[scene.triangle_surface], occurrences)
    corner = scene.vertices[scene.triangles[mine]]
    way = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(way, axis=1)
    normal = way / np.maximum(area, 1e-12)[:, None]
    # Both sides of a plate face the same way; rounding makes classes of normals.
    ahead = normal * np.where(normal[np.arange(len(normal)), np.abs(normal).argmax(axis=1)] < 0, -1.0, 1.0)[:, None]
    _, kind = np.unique(np.rint(ahead * 50), axis=0, return_inverse=True)
    most = ahead[kind.ravel() == np.argmax(np.bincount(kind.ravel(), area))][0]
    first = np.cross(most, np.eye(3)[np.abs(most).argmin()])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(most, first), most])


@dataclass(frozen=True)
class _Camera:
    """A camera's pose (4, 4) and matrix (3, 3), its elements' places and normals (e, 2), a tree over them, and which of
    all cameras' elements they are."""

    pose: Floats
    matrix: Floats
    position: Floats
    normal: Floats
    tree: cKDTree
    elements: slice


def _list_cameras(rig: Rig, world_from_rig: Floats, indexes: list[EdgeIndex]) -> list[_Camera]:
    out, first = [], 0
    for (name, camera), index in zip(rig.cameras.items(), indexes, strict=True):
        place = index.edges.position
        pose = world_from_rig @ rig.rig_from_camera[name]
        elements = slice(first, first + len(place))
        out.append(_Camera(pose, camera.matrix, place, index.edges.normal, cKDTree(place), elements))
        first += len(place)
    return out


@dataclass(frozen=True)
class _View:
    """What a camera should see of a piece: samples' points (n, 3), image directions (n, 2), lengths px; free (e,):
    which elements no other piece's edge takes."""

    camera: _Camera
    point: Floats
    direction: Floats
    length: Floats
    free: Bools


def _list_views(samples: Samples, weight: Floats, cameras: list[_Camera], free: Bools) -> list[_View]:
    """Of the cameras that see something."""
    out = []
    for number, camera in enumerate(cameras):
        own = samples.camera == number
        if own.any():
            out.append(_View(camera, samples.point[own], samples.direction[own], weight[own], free[camera.elements]))
    return out


@dataclass(frozen=True)
class _Place:
    """Where a piece lies: axes (3, 3) as rows; x (4,): mm along them, then rad about the last; covariance (4, 4)."""

    axes: Floats
    x: Floats
    covariance: Floats
    log_odds: float
    moved: bool


def _locate(views: list[_View], centre: Floats, axes: Floats, chance: float, p: DisplacedParameters) -> _Place:
    """The place near the model's where most edges of a piece are found."""

    # How much denser elements lie on an edge that shows than by chance, which is counted in windows of four px.
    dense = p.shows / (np.sqrt(2 * np.pi) * p.sigma_px) / (max(chance, p.least_chance) / 4)

    total = sum(float(view.length.sum()) for view in views)

    def weigh(x: Floats) -> tuple[float, float]:
        """Log odds of an edge at each sample against chance, and the share of the edges found."""
        odds = found = 0.0
        for view in views:
            residual = np.abs(_look(view, centre, axes, x, p.reach_px[0])[1])
            near = np.exp(-0.5 * (np.where(np.isfinite(residual), residual, np.inf) / p.sigma_px) ** 2)
            odds += float(view.length @ np.log1p(dense * near)) / p.stretch_px
            found += float(view.length @ (residual <= p.found_px)) / total
        return odds, found

    around = p.start_mm * np.stack(np.meshgrid([0.0, 1, -1], [0.0, 1, -1]), axis=-1).reshape(-1, 2)
    tried = [_fit(views, centre, axes, np.array([*start, 0.0, 0.0]), p.seated_mm, p) for start in around]
    x, covariance = max(tried, key=lambda fitted: weigh(fitted[0])[0])
    risen, loose = _fit(views, centre, axes, x, p.rise_mm, p)
    if weigh(risen)[0] > weigh(x)[0] + p.least_log_odds:
        x, covariance = risen, loose
    (odds, found), (odds_in_place, found_in_place) = weigh(x), weigh(np.zeros(4))
    log_odds = odds - odds_in_place - float(np.log(len(around)))
    distance, sigma = _measure_distance(x, covariance)
    moved = (
        log_odds >= p.least_log_odds
        and found >= max(p.least_found, found_in_place + p.least_gain)
        and distance > max(p.least_mm, p.least_sigma * sigma)
    )
    return _Place(axes, x, covariance, log_odds, moved)


def _fit(
    views: list[_View], centre: Floats, axes: Floats, start: Floats, rise_mm: float, p: DisplacedParameters
) -> tuple[Floats, Floats]:
    """The displacement (4,) that the elements near a piece's edges agree on, and its covariance (4, 4)."""
    x = start.copy()
    loose = np.diag(np.array([p.plane_mm, p.plane_mm, rise_mm, p.turn]) ** -2.0)
    hessian = loose
    for reach in p.reach_px:
        hessian, gradient = loose.copy(), -loose @ x
        for view in views:
            slope, residual = _look(view, centre, axes, x, reach)
            found = np.isfinite(residual)
            slope, residual = slope[found], residual[found]
            weight = view.length[found] / (p.stretch_px * p.sigma_px**2 * (1 + (residual / p.scale_px) ** 2) ** 2)
            hessian += (slope * weight[:, None]).T @ slope
            gradient += slope.T @ (weight * residual)
        x = x + np.linalg.solve(hessian, gradient)
    return x, np.asarray(np.linalg.inv(hessian))


def _look(view: _View, centre: Floats, axes: Floats, x: Floats, reach_px: float) -> tuple[Floats, Floats]:
    """Of samples displaced by x: how their edges move along the image normals by each of x (n, 4), how far the nearest
    element of about their direction lies along it (n,), px, nan where none lies within the reach."""
    camera = view.camera
    cosine, sine = np.cos(x[3]), np.sin(x[3])
    turn = axes.T @ np.array([[cosine, -sine, 0], [sine, cosine, 0], [0, 0, 1.0]]) @ axes
    arm = (view.point - centre) @ turn.T
    seen = (centre + arm + x[:3] @ axes - camera.pose[:3, 3]) @ camera.pose[:3, :3]
    pixel = (seen / seen[:, 2:] @ camera.matrix.T)[:, :2]
    across = np.stack([-view.direction[:, 1], view.direction[:, 0]], axis=1)
    # How much a motion along each of the camera's axes moves the edge.
    push = across @ camera.matrix[:2, :2] / seen[:, 2:]
    push = np.concatenate([push, -np.einsum("ni,ni->n", push, seen[:, :2] / seen[:, 2:])[:, None]], axis=1)
    push = push @ camera.pose[:3, :3].T
    slope = np.concatenate([push @ axes.T, np.einsum("ni,ni->n", push, np.cross(axes[2], arm))[:, None]], axis=1)

    distance, near = camera.tree.query(pixel, k=NEAREST, distance_upper_bound=reach_px + BESIDE_PX)
    near = np.where(np.isfinite(distance), near, 0)
    apart = camera.position[near] - pixel[:, None]
    along = np.einsum("nki,ni->nk", apart, across)
    fits = np.isfinite(distance) & view.free[near] & (np.abs(along) <= reach_px)
    fits &= np.abs(np.einsum("nki,ni->nk", apart, view.direction)) <= BESIDE_PX
    fits &= np.abs(np.einsum("nki,ni->nk", camera.normal[near], across)) >= MIN_COSINE
    along = np.where(fits, along, np.inf)
    nearest = along[np.arange(len(along)), np.argmin(np.abs(along), axis=1)]
    return slope, np.where(np.isfinite(nearest), nearest, np.nan)


def _measure_distance(x: Floats, covariance: Floats) -> tuple[float, float]:
    """How far a displacement goes, mm, and its standard deviation along it."""
    distance = float(np.linalg.norm(x[:3]))
    way = x[:3] / distance if distance > 0 else np.eye(3)[0]
    return distance, float(np.sqrt(way @ covariance[:3, :3] @ way))


def _gather(found: list[tuple[int, _Place]]) -> Displacements:
    places = [place for _, place in found]
    distance = np.array([_measure_distance(p.x, p.covariance) for p in places]).reshape(-1, 2)
    return Displacements(
        occurrence=np.array([occurrence for occurrence, _ in found], np.int64),
        shift=np.array([p.x[:3] @ p.axes for p in places]).reshape(-1, 3),
        shift_sigma=np.array([np.sqrt(np.diag(p.axes.T @ p.covariance[:3, :3] @ p.axes)) for p in places]).reshape(
            -1, 3
        ),
        distance=distance[:, 0],
        sigma=distance[:, 1],
        turn=np.array([p.x[3] for p in places]),
        turn_sigma=np.array([p.covariance[3, 3] ** 0.5 for p in places]),
        log_odds=np.array([p.log_odds for p in places]),
        moved=np.array([p.moved for p in places], bool),
    )


def tell_displacements(items: Items, displacements: Displacements) -> Measures:
    """Of the parts that lie elsewhere how far, along the world's axes too, and how they are turned."""
    part = np.array([level == "part" for level in items.level])
    rows = np.flatnonzero(part & np.isin(items.occurrence, displacements.occurrence[displacements.moved]))
    order = np.argsort(displacements.occurrence)
    at = order[np.searchsorted(displacements.occurrence, items.occurrence[rows], sorter=order)]
    it = displacements
    columns = [
        ("displacement", it.distance, it.sigma),
        *((name, it.shift[:, k], it.shift_sigma[:, k]) for k, name in enumerate(("dx", "dy", "dz"))),
        ("turn", np.degrees(it.turn), np.degrees(it.turn_sigma)),
    ]
    return Measures(
        item=np.tile(rows, len(columns)),
        what=[name for name, _, _ in columns for _ in rows],
        nominal=np.zeros(len(columns) * len(rows)),
        value=np.concatenate([value[at] for _, value, _ in columns]),
        sigma=np.concatenate([sigma[at] for _, _, sigma in columns]),
        changed=np.array([name == "displacement" for name, _, _ in columns for _ in rows], bool),
    )
