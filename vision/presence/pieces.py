"""Pieces of the model that are moved as one, a part or an assembly, and what cameras should see of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TypeVar

import numpy as np

from relmodel.arrays import Floats, Ints, rank_in_groups, sum_by_group
from relmodel.columns import Rows
from relmodel.geometry.transforms import rotation_matrix
from vision.presence.presence_parameters import PartParameters
from vision.presence.samples import Samples
from vision.presence.stretches import Runs
from vision.scene.scene import Scene


def find_pieces(paths: Sequence[str]) -> Ints:
    """The piece (o,) that each occurrence belongs to: the parts of an assembly within an object are one piece."""
    above = [path.rpartition("/")[0] for path in paths]
    pieces = [group if "/" in group else path for path, group in zip(paths, above, strict=True)]
    return np.asarray(np.unique(pieces, return_inverse=True)[1].ravel(), np.int64)


def find_axes(scene: Scene, occurrences: Ints, ahead: Floats) -> Floats:
    """Unit vectors (3, 3): two along the plane that most of the surface of parts is parallel to, and its normal, which
    points to the side that the direction `ahead` (3,) does."""
    mine = np.isin(scene.surface_occurrence[scene.triangle_surface], occurrences)
    corner = scene.vertices[scene.triangles[mine]]
    way = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    area = np.linalg.norm(way, axis=1)
    normal = way / np.maximum(area, 1e-12)[:, None]
    # Both sides of a plate face the same way; rounding makes classes of normals.
    largest = normal[np.arange(len(normal)), np.abs(normal).argmax(axis=1)]
    upright = np.where(largest < 0, -1.0, 1.0)[:, None] * normal
    _, kind = np.unique(np.rint(upright * 50), axis=0, return_inverse=True)
    most = upright[kind.ravel() == np.argmax(np.bincount(kind.ravel(), area))][0]
    most = most if most @ ahead >= 0 else -most
    first = np.cross(most, np.eye(3)[np.abs(most).argmin()])
    first /= np.linalg.norm(first)
    return np.stack([first, np.cross(most, first), most])


@dataclass(frozen=True)
class Eyes:
    """Cameras' poses (c, 4, 4) in the world and matrices (c, 3, 3)."""

    pose: Floats
    matrix: Floats

    def project(self, camera: Ints, point: Floats, ways: Floats) -> tuple[Floats, Floats]:
        """Pixels (n, 2) of points (n, 3), and how they move (n, k, 2), px a mm, by motions (n, k, 3) of these."""
        pixel, flow = np.empty((len(camera), 2)), np.empty((*ways.shape[:2], 2))
        for number, (pose, matrix) in enumerate(zip(self.pose, self.matrix, strict=True)):
            mine = camera == number
            seen, there = (point[mine] - pose[:3, 3]) @ pose[:3, :3], ways[mine] @ pose[:3, :3]
            flat = seen[:, :2] / seen[:, 2:]
            pixel[mine] = flat @ matrix[:2, :2].T + matrix[:2, 2]
            flow[mine] = (there[..., :2] - there[..., 2:] * flat[:, None]) / seen[:, 2, None, None] @ matrix[:2, :2].T
        return pixel, flow


@dataclass(frozen=True)
class Aspects(Rows):
    """How pieces are looked for, as columns: piece; angle, rad, that it is turned about the last of its axes (a, 3, 3)
    through its centre (a, 3)."""

    piece: Ints
    angle: Floats
    centre: Floats
    axes: Floats


@dataclass(frozen=True)
class PieceEdges(Rows):
    """What cameras should see of aspects, as columns: camera; aspect; edge, of one camera: it shows or hides by itself;
    point (n, 3) in the world; direction (n, 2) in the picture; length, px; chance, shows: as `Runs` has them."""

    camera: Ints
    aspect: Ints
    edge: Ints
    point: Floats
    direction: Floats
    length: Floats
    chance: Floats
    shows: Floats

    def thin(self, enough: int) -> PieceEdges:
        """Of many samples of an aspect in a camera every so many, which then stand for the others."""
        group = self.camera * (self.aspect.max(initial=0) + 1) + self.aspect
        step = 1 + np.bincount(group) // enough
        rows = np.flatnonzero(rank_in_groups(group, np.zeros(len(group))) % step[group] == 0)
        some = self.take(rows)
        return replace(some, length=some.length * step[group[rows]])


T = TypeVar("T", Aspects, PieceEdges)


def list_pieces(
    scene: Scene,
    piece_of: Ints,
    pieces: Ints,
    samples: Samples,
    weight: Floats,
    runs: Runs,
    eyes: Eyes,
) -> tuple[PieceEdges, Aspects]:
    """What cameras see of pieces where the model has them, an aspect each."""
    of_sample = piece_of[scene.surface_occurrence[samples.surface[:, 0]]]
    rows = np.flatnonzero(np.isin(of_sample, pieces) & (weight > 0))
    aspect, run = np.searchsorted(pieces, of_sample[rows]), samples.run[rows]
    edges = PieceEdges(
        samples.camera[rows], aspect, run, samples.point[rows], samples.direction[rows], weight[rows],
        runs.chance[run], runs.shows[run],
    )  # fmt: skip
    centre = sum_by_group(aspect, edges.point, len(pieces), edges.length)
    centre /= np.bincount(aspect, edges.length, len(pieces))[:, None]
    ahead = eyes.pose[:, :3, 3].mean(axis=0) - centre
    axes = [find_axes(scene, np.flatnonzero(piece_of == k), way) for k, way in zip(pieces.tolist(), ahead, strict=True)]
    return edges, Aspects(pieces, np.zeros(len(pieces)), centre, np.reshape(axes, (-1, 3, 3)))


def add_turned(
    scene: Scene, piece_of: Ints, lost: Ints, edges: PieceEdges, aspects: Aspects, eyes: Eyes, p: PartParameters
) -> tuple[PieceEdges, Aspects]:
    """With the edges of lost pieces at every turn about their middle: those of faces toward the cameras."""
    angle = np.radians(np.arange(p.step_degrees, 360.0, p.step_degrees))
    pieces, more, turns = [edges], [aspects], np.zeros(len(angle), np.int64)
    for number in np.flatnonzero(np.isin(aspects.piece, lost)).tolist():
        members = np.flatnonzero(piece_of == aspects.piece[number])
        mine = np.isin(scene.arc_occurrence[scene.sample_arc], members) & (scene.sample_cosine < p.max_cosine)
        if not mine.any():
            continue
        place = scene.sample_point[mine]
        centre, axes = 0.5 * (place.min(axis=0) + place.max(axis=0)), aspects.axes[number]
        ways = np.stack([scene.sample_tangent[mine], scene.sample_normal_a[mine], scene.sample_normal_b[mine]], axis=1)
        back = np.swapaxes(rotation_matrix(angle[:, None] * axes[2]), 1, 2)
        point, way = centre + (place - centre) @ back, ways @ back[:, None]
        own, begins = edges.aspect == number, sum(len(a.piece) for a in more)
        usual = [np.average(v[own], weights=edges.length[own]) for v in (edges.chance, edges.shows)]
        for camera, pose in enumerate(eyes.pose):
            front = np.einsum("tnki,tni->tnk", way[:, :, 1:], pose[:3, 3] - point) > 0
            turn, sample = np.nonzero(front.any(axis=2))
            same, at = np.full(len(turn), camera), (turn, sample)
            direction = eyes.project(same, point[at], way[at][:, :1])[1][:, 0]
            stretch = np.maximum(np.linalg.norm(direction, axis=1), 1e-9)
            pieces.append(
                PieceEdges(
                    same, begins + turn, scene.sample_arc[mine][sample] * len(eyes.pose) + camera, point[at],
                    direction / stretch[:, None], scene.sample_length[mine][sample] * stretch,
                    *np.repeat(usual, len(turn)).reshape(2, -1),
                )
            )  # fmt: skip
        more.append(replace(aspects.take(turns + number), angle=angle, centre=np.tile(centre, (len(angle), 1))))
    return _join(pieces), _join(more)


def _join(tables: Sequence[T]) -> T:
    """The rows of all."""
    kind = type(tables[0])
    return kind(*(np.concatenate([getattr(t, name) for t in tables]) for name in kind.__dataclass_fields__))
