"""Arcs and regions of a picture that may be an object and that no predicted edge accounts for.

A region is unexplained where most of its border runs along such arcs: a bolt, a plug, a patch or a part that the model
does not have.  Its border is then an edge of clear contrast and no edge of the model, so it is of another brightness
than the surface that it lies on.  Texture, highlights and shading have no such arcs around them, and shadows of the
structure begin at predicted edges.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.cameras.cameras import Camera, Rig
from vision.extraction.arcs import LINE
from vision.extraction.primitives import Primitives
from vision.localisation.measurements import EdgeIndex
from vision.localisation.views import ViewArcs
from vision.localisation.visibility import VisibleArcs
from vision.presence.presence_parameters import UnexplainedParameters
from vision.scene.scene import Scene

KINDS = ("closed", "curved", "straight", "region")
CLOSED, CURVED, STRAIGHT, REGION = range(4)
NONE = -1  # arc of a region, region of an arc


@dataclass(frozen=True)
class Unexplained:
    """Arcs and regions of the pictures, the most telling first, as columns: camera: number in the rig; kind: index of
    KINDS; arc, region: in its picture, NONE of the other; box (n, 4): least x, y, greatest x, y, px of the picture;
    length px, of a region of the border that is unexplained; contrast grey, mean along it; beyond: whether most of it
    lies where the model shows nothing at all."""

    camera: Ints
    kind: Ints
    arc: Ints
    region: Ints
    box: Floats
    length: Floats
    contrast: Floats
    beyond: Bools


def find_unexplained(
    scene: Scene,
    rig: Rig,
    pictures: Mapping[str, Primitives],
    indexes: list[EdgeIndex],
    world_from_rig: Floats,
    views: Mapping[str, ViewArcs],
    p: UnexplainedParameters,
) -> Unexplained:
    """Closed curves, long straight edges, curved ones and regions that no predicted edge or blend accounts for, at a
    pose.  Brush texture, shades and highlights are left out, as extraction marks them."""
    pieces = []
    for number, (name, camera) in enumerate(rig.cameras.items()):
        picture, index = pictures[name], indexes[number]
        explained = lie_on(index, views[name].samples, p.reach_px, p.min_cosine)
        share = _share(explained, picture.elements.arc, len(picture.arcs))
        free = _are_edges(picture, index, p) & (share < p.most_explained)
        pose = world_from_rig @ rig.rig_from_camera[name]
        pieces += [
            (np.full(len(found[0]), number), *found)
            for found in (
                _find_arcs(scene, camera, pose, picture, index, free, p),
                _find_regions(scene, camera, pose, picture, free, p),
            )
        ]
    columns = [np.concatenate(column) for column in zip(*pieces, strict=True)]
    order = np.argsort(-columns[5] * columns[6], kind="stable")
    return Unexplained(*(column[order] for column in columns))


_Columns = tuple[Ints, Ints, Ints, Floats, Floats, Floats, Bools]  # of Unexplained, but for the camera


def _find_arcs(
    scene: Scene, camera: Camera, pose: Floats, picture: Primitives, index: EdgeIndex, free: Bools,
    p: UnexplainedParameters,
) -> _Columns:  # fmt: skip
    """Of the `free` arcs those long enough to form something."""
    arcs, owner = picture.arcs, picture.elements.arc
    rows = np.flatnonzero(free & (arcs.length >= np.where(arcs.closed, p.least_closed_px, p.least_px)))
    members = np.flatnonzero(np.isin(owner, rows))
    beyond = np.zeros(len(owner), bool)
    beyond[members] = _see_nothing(scene, camera, pose, index.edges.position[members])
    kind = np.where(arcs.closed, CLOSED, np.where(arcs.kind == LINE, STRAIGHT, CURVED))
    return (
        kind[rows], rows, np.full(len(rows), NONE), _boxes(picture, rows), arcs.length[rows], arcs.contrast[rows],
        _share(beyond, owner, len(arcs))[rows] > 0.5,
    )  # fmt: skip


def _find_regions(
    scene: Scene, camera: Camera, pose: Floats, picture: Primitives, free: Bools, p: UnexplainedParameters
) -> _Columns:
    """Regions most of whose border runs along `free` arcs, the border of the picture left out."""
    regions, count = picture.regions, len(picture.regions)
    ring = np.repeat(np.arange(len(regions.ring_region)), np.diff(regions.ring_offsets))
    after = np.arange(1, len(ring) + 1)
    after[regions.ring_offsets[1:] - 1] = regions.ring_offsets[:-1]
    way = (regions.outline[after] - regions.outline).astype(float)
    middle, owner = regions.outline + 0.5 * way, regions.ring_region[ring]
    size = np.array(picture.shape[::-1])
    inside = ((middle >= p.rim_px) & (middle <= size - 1 - p.rim_px)).all(axis=1)
    around = np.bincount(owner, np.linalg.norm(way, axis=1) * inside, count)

    along, arc = regions.border_region, regions.border_arc
    own = regions.border_length * free[arc]
    bordered = np.bincount(along, regions.border_length, count)
    unexplained = np.bincount(along, own, count).astype(float)
    rows = np.flatnonzero(
        (regions.area >= p.least_area_px)
        & (unexplained >= np.maximum(p.least_border * bordered, p.least_closed_px))
        & (bordered > p.least_border * around)
        & (regions.saturated_share < p.most_highlight)
    )
    contrast = np.bincount(along, own * picture.arcs.contrast[arc], count) / np.maximum(unexplained, 1e-9)
    of = np.flatnonzero(np.isin(owner, rows))
    length = np.linalg.norm(way[of], axis=1)
    beyond = np.bincount(owner[of], length * _see_nothing(scene, camera, pose, camera.undistort(middle[of])), count)
    total = np.bincount(owner[of], length, count)
    box = np.stack([regions.x0, regions.y0, regions.x1, regions.y1], axis=1)
    return (
        np.full(len(rows), REGION), np.full(len(rows), NONE), rows, box[rows], unexplained[rows], contrast[rows],
        beyond[rows] > 0.5 * total[rows],
    )  # fmt: skip


def lie_on(index: EdgeIndex, seen: VisibleArcs, reach_px: float, min_cosine: float) -> Bools:
    """Which elements lie within a reach of predicted arcs of about their direction."""
    from scipy.spatial import cKDTree

    edges = index.edges
    if not len(seen.arc):
        return np.zeros(len(edges.position), bool)
    distance, nearest = cKDTree(seen.pixel).query(edges.position, distance_upper_bound=reach_px)
    direction = seen.direction[np.where(np.isfinite(distance), nearest, 0)]
    across = np.abs(edges.normal[:, 1] * direction[:, 0] - edges.normal[:, 0] * direction[:, 1])
    return np.asarray(np.isfinite(distance) & (across > min_cosine))


def _are_edges(picture: Primitives, index: EdgeIndex, p: UnexplainedParameters) -> Bools:
    """Which arcs are no texture, shading or highlight, and of clear contrast.  What closes around something dark is the
    border of that, not of the highlight around."""
    arcs = picture.arcs
    is_highlight = (arcs.highlight >= p.most_highlight) & ~(arcs.closed & _is_dark_inside(picture))
    real = (arcs.texture < p.most_texture) & ~is_highlight
    # In a picture without texture most elements are edges of the part.
    clear = min(p.least_contrast * index.texture, p.clear_share * index.edges.grey_range)
    return np.asarray(real & (arcs.contrast > clear))


def _is_dark_inside(picture: Primitives) -> Bools:
    """Of arcs that close, whether the bright side of their elements lies outside."""
    elements, arcs = picture.elements, picture.arcs
    own = np.flatnonzero(elements.arc >= 0)
    arc, count = elements.arc[own], len(arcs)
    number = np.maximum(np.bincount(arc, minlength=count), 1)
    out = np.zeros(count)
    for at, way in ((elements.x[own], elements.nx[own]), (elements.y[own], elements.ny[own])):
        middle = np.bincount(arc, at, count) / number
        out += np.bincount(arc, (at - middle[arc]) * way, count)
    return out > 0


def _share(of: Bools, owner: Ints, count: int) -> Floats:
    """The share of each arc's elements (n,) that are so."""
    own = owner >= 0
    return np.bincount(owner[own], of[own], count) / np.maximum(np.bincount(owner[own], minlength=count), 1)


def _see_nothing(scene: Scene, camera: Camera, world_from_camera: Floats, pixel: Floats) -> Bools:
    """Where rays through pixels (n, 2) of the camera without distortion meet nothing of the model."""
    rays = np.concatenate([camera.normalise(pixel), np.ones((len(pixel), 1))], axis=1) @ world_from_camera[:3, :3].T
    return np.asarray(scene.rays.nearest(world_from_camera[:3, 3], rays) < 0)


def _boxes(picture: Primitives, rows: Ints) -> Floats:
    """Boxes (n, 4) of arcs by their elements."""
    elements = picture.elements
    first, last = picture.arcs.offsets[rows], picture.arcs.offsets[rows + 1]
    out = np.empty((len(rows), 4))
    bounds = np.stack([first, last], axis=1).ravel()
    at = np.minimum(bounds, len(elements.x) - 1)
    for column, (values, least) in enumerate(
        ((elements.x, True), (elements.y, True), (elements.x, False), (elements.y, False))
    ):
        pick = np.minimum if least else np.maximum
        out[:, column] = pick.reduceat(values, at)[::2] if len(rows) else 0.0
    return out
