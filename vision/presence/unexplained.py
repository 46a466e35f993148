"""What a picture shows where the model shows nothing: arcs that form something and belong to no predicted edge."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.cameras.cameras import Camera, Rig
from vision.extraction.arcs import LINE
from vision.extraction.primitives import ArcColumns, Primitives
from vision.localisation.measurements import EdgeIndex
from vision.localisation.scene import Scene
from vision.localisation.views import ViewArcs
from vision.localisation.visibility import VisibleArcs
from vision.presence.parameters import UnexplainedParameters

KINDS = ("closed", "curved", "straight")
CLOSED, CURVED, STRAIGHT = range(3)


@dataclass(frozen=True)
class Unexplained:
    """Arcs of the pictures, the most telling first, as columns: camera: number in the rig; arc: in its picture; kind:
    index of KINDS; box (n, 4): least x, y, greatest x, y, px of the picture; length px; contrast grey; beyond: whether
    most of it lies where the model shows nothing at all."""

    camera: Ints
    arc: Ints
    kind: Ints
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
    """Closed curves, long straight edges and curved ones that no predicted edge or blend accounts for, at a pose.
    Brush texture, shades and highlights are left out, as extraction tells them."""
    pieces = []
    for number, (name, camera) in enumerate(rig.cameras.items()):
        picture, index = pictures[name], indexes[number]
        explained = lie_on(index, views[name].samples, p.reach_px, p.min_cosine)
        arcs, owner = picture.arcs, picture.elements.arc
        rows = np.flatnonzero(
            _form_something(arcs, index, p) & (_share(explained, owner, len(arcs)) < p.most_explained)
        )
        pose = world_from_rig @ rig.rig_from_camera[name]
        members = np.flatnonzero(np.isin(owner, rows))
        beyond = np.zeros(len(owner), bool)
        beyond[members] = _see_nothing(scene, camera, pose, index.edges.position[members])
        kind = np.where(arcs.closed, CLOSED, np.where(arcs.kind == LINE, STRAIGHT, CURVED))
        pieces.append(
            (
                np.full(len(rows), number), rows, kind[rows], _boxes(picture, rows), arcs.length[rows],
                arcs.contrast[rows], _share(beyond, owner, len(arcs))[rows] > 0.5,
            )
        )  # fmt: skip
    columns = [np.concatenate(column) for column in zip(*pieces, strict=True)]
    order = np.argsort(-columns[4] * columns[5], kind="stable")
    return Unexplained(*(column[order] for column in columns))


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


def _form_something(arcs: ArcColumns, index: EdgeIndex, p: UnexplainedParameters) -> Bools:
    long = arcs.length >= np.where(arcs.closed, p.least_closed_px, p.least_px)
    real = (arcs.texture < p.most_texture) & (arcs.highlight < p.most_highlight)
    return np.asarray(long & real & (arcs.contrast > p.least_contrast * index.texture))


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
