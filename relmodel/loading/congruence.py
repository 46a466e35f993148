"""Shapes of a file that are one shape in several places: sharing that a flattened file has lost, found again.

Shapes that may be congruent are told by what no rigid motion changes: how many faces and edges of which kinds, with
which areas, radii, lengths and convexities, and a triple product that a mirror turns over.  A motion that takes one to
the other is then looked for by its centre and two landmarks, and holds only where every face and edge lies on its like
to round-off; being a rotation, it never takes a shape to its mirror image (unless that is the shape itself).
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import vectors
from relmodel.geometry.surfaces import ANALYTIC_KINDS
from relmodel.geometry.transforms import apply, nearest_rotation
from relmodel.loading.brep import curves_of, surfaces_of
from relmodel.loading.clusters import clusters
from relmodel.loading.neutral import LoadedModel, Shape

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

# Round-off of a file's digits: mm, and of the extent of a shape.
ROUND_OFF_MM = 2e-6
ROUND_OFF_SHARE = 1e-9
_MOST_TRIALS = 256


@dataclass
class Congruence:
    """Motion that takes one shape to another, and which of its faces and edges each of the other's is."""

    motion: Floats  # (4, 4)
    surfaces: Ints
    arcs: Ints


def share(model: LoadedModel) -> None:
    """Let parts of congruent shapes have the first of these, placed by the motion; in place.

    The frame of such a part becomes that of the first; shapes that no part has any more are dropped.
    """
    of, motion, like = _classes(model.shapes)
    if np.array_equal(of, np.arange(len(of))):
        return
    left = np.unique(of)
    number = {int(shape): i for i, shape in enumerate(left)}
    for assembly in model.assemblies:
        for one in assembly.instances:
            if one.kind == "part":
                one.parent_from_child = one.parent_from_child @ motion[model.parts[one.child].shape]
    for part in model.parts:
        if part.shape in like:
            there = {theirs: ours for ours, theirs in reversed(list(enumerate(like[part.shape].tolist())))}
            part.pmi = [replace(p, surfaces=tuple((there[s], role) for s, role in p.surfaces)) for p in part.pmi]
        part.shape = number[int(of[part.shape])]
    model.shapes = [model.shapes[i] for i in left.tolist()]


def _classes(shapes: list[Shape]) -> tuple[Ints, Floats, dict[int, Ints]]:
    """The first shape that each (n,) is congruent to, the motions (n, 4, 4) from there, and of a shape that is not
    itself the first which of its faces each face of the first is."""
    of, motion = np.arange(len(shapes)), np.tile(np.eye(4), (len(shapes), 1, 1))
    like: dict[int, Ints] = {}
    firsts: dict[tuple[str, ...], list[int]] = {}
    elements: dict[int, _Elements] = {}
    for i, shape in enumerate(shapes):
        if not shape.surfaces or shape.kind == "wire" or not shape.arcs or "fitted" in shape.surfaces["provenance"]:
            continue
        alike = firsts.setdefault(_counts(shape), [])
        for first in alike:
            for k in (first, i):
                if k not in elements:
                    elements[k] = _Elements.of(shapes[k])
            found = _fit(elements[first], elements[i])
            if found is not None:
                of[i], motion[i], like[i] = first, found.motion, found.surfaces
                break
        else:
            alike.append(i)
    return of, motion, like


def _counts(shape: Shape) -> tuple[str, ...]:
    """What must be the same to the last digit: kinds, names and colours of faces, kinds and convexities of edges."""
    return shape.kind, *sorted(_face_kinds(shape)), *sorted(_edge_kinds(shape))


def congruent(first: Shape, other: Shape) -> Congruence | None:
    """The motion that takes the first shape to the other, or None where they are not congruent."""
    if _counts(first) != _counts(other):
        return None
    return _fit(_Elements.of(first), _Elements.of(other))


@dataclass
class _Elements:
    """Faces, then edges, of a shape.

    kind: what no motion changes at all; sizes (n, 3), mm (of a face the root of its area): what it changes by
    round-off; points (n, 3, 3): what moves along, of an edge its middle and ends.
    """

    kind: list[str]
    sizes: Floats
    points: Floats
    faces: int
    extent: float
    chirality: float

    @classmethod
    def of(cls, shape: Shape) -> _Elements:
        s, a = shape.surfaces, shape.arcs
        surfaces, curves = surfaces_of(shape), curves_of(shape)
        n = len(surfaces)
        centroid, area = vectors(s, "centroid"), np.asarray(s["area"], float)
        # A free-form face has more to it than its area and its boundary: a point amid its domain.
        amid = surfaces.evaluate(np.arange(n), *surfaces.domain.reshape(-1, 2, 2).mean(axis=2).T).points
        amid[np.isin(surfaces.kind.astype(str), ANALYTIC_KINDS)] = np.nan
        amid = np.where(np.isnan(amid), centroid, amid)
        middle = curves.evaluate(np.arange(len(curves)), (curves.t0 + curves.t1) / 2)[0]
        points = np.concatenate(
            [
                np.stack([centroid, amid, amid], axis=1),
                np.stack([middle, vectors(a, "start"), vectors(a, "end")], axis=1),
            ]
        )
        sizes = np.concatenate(
            [
                np.column_stack([np.sqrt(area), surfaces.radius, surfaces.radius2]),
                np.column_stack([np.asarray(a["length"], float), curves.radius, curves.radius2]),
            ]
        )
        arms = points[:, 0] - points[:, 0].mean(axis=0)
        extent = float(np.linalg.norm(arms, axis=1).max())
        return cls(
            [*_face_kinds(shape), *_edge_kinds(shape)],
            np.nan_to_num(sizes),
            points,
            n,
            extent,
            _chirality(arms, sizes, n),
        )


def _face_kinds(shape: Shape) -> list[str]:
    s = shape.surfaces
    marks = [s[c] for c in ("kind", "name", "colour", "layer") if c in s]
    return ["face|" + "|".join(map(str, row)) for row in zip(*marks, strict=True)]


def _edge_kinds(shape: Shape) -> list[str]:
    return ["edge|" + "|".join(row) for row in zip(shape.arcs["kind"], shape.arcs["convexity"], strict=True)]


def _chirality(arms: Floats, sizes: Floats, faces: int) -> float:
    """Triple product of three means of the elements' places, weighed by size: of a mirror image its negative."""
    size = sizes[:, 0]
    face = np.arange(len(size)) < faces
    weights = (size**2 * face, size**4 * face, size * ~face)
    reach = np.linalg.norm(arms, axis=1).max()
    means = [w @ arms / max(w.sum() * reach, 1e-300) for w in weights]
    return float(np.linalg.det(np.stack(means)))


def _fit(a: _Elements, b: _Elements) -> Congruence | None:
    """The motion that takes the elements a to the elements b within round-off."""
    least = ROUND_OFF_MM + ROUND_OFF_SHARE * a.extent
    if abs(a.extent - b.extent) > 20 * least or abs(a.chirality - b.chirality) > 1e-6 + 1e-3 * abs(a.chirality):
        return None
    label = _labels(a, b, 20 * least)
    if label is None:
        return None
    frames = _landmarks(a, b, label, 20 * least)
    for motion in frames:
        to = _matched(a, b, label, motion, 50 * least)
        if to is None:
            continue
        motion = _best_motion(a.points.reshape(-1, 3), _turned_about(a, b, to, motion).reshape(-1, 3))
        off = np.linalg.norm(apply(motion, a.points) - _turned_about(a, b, to, motion), axis=2)
        if off.max() <= least:
            return Congruence(motion, to[: a.faces], to[a.faces :] - a.faces)
    return None


def _labels(a: _Elements, b: _Elements, tolerance: float) -> tuple[Ints, Ints] | None:
    """Label of each element of both, equal for those of one kind and of one size; None where they do not pair off."""
    kind = np.unique([*a.kind, *b.kind], return_inverse=True)[1]
    apart = 10 * (tolerance + max(float(np.abs(x.sizes).max()) for x in (a, b)))
    label = clusters(np.column_stack([kind * apart, np.concatenate([a.sizes, b.sizes])]), tolerance)
    of_a, of_b = label[: len(a.kind)], label[len(a.kind) :]
    if not np.array_equal(np.sort(of_a), np.sort(of_b)):
        return None
    return of_a, of_b


def _landmarks(a: _Elements, b: _Elements, label: tuple[Ints, Ints], tolerance: float) -> Iterator[Floats]:
    """Motions that take the centre and two landmarks of a to the like of b."""
    of_a, of_b = label
    centre_a, centre_b = (x.points[:, 0].mean(axis=0) for x in (a, b))
    arm_a, arm_b = a.points[:, 0] - centre_a, b.points[:, 0] - centre_b
    count = np.bincount(of_a)[of_a]
    reach_a, reach_b = np.linalg.norm(arm_a, axis=1), np.linalg.norm(arm_b, axis=1)
    far = np.flatnonzero(reach_a >= 0.3 * reach_a.max())
    p = int(far[np.lexsort((-reach_a[far], count[far]))[0]])
    across = np.linalg.norm(np.cross(arm_a[p], arm_a), axis=1)
    beside = np.flatnonzero(across >= 0.3 * across.max())
    q = int(beside[np.lexsort((-across[beside], count[beside]))[0]])
    frame_a = _frame(arm_a[p], arm_a[q])
    trials = 0
    for i in np.flatnonzero((of_b == of_a[p]) & (np.abs(reach_b - reach_a[p]) <= tolerance)).tolist():
        apart = np.linalg.norm(arm_b - arm_b[i], axis=1) - np.linalg.norm(arm_a[q] - arm_a[p])
        like = (of_b == of_a[q]) & (np.abs(reach_b - reach_a[q]) <= tolerance) & (np.abs(apart) <= tolerance)
        for j in np.flatnonzero(like).tolist():
            motion = np.eye(4)
            motion[:3, :3] = _frame(arm_b[i], arm_b[j]) @ frame_a.T
            motion[:3, 3] = centre_b - motion[:3, :3] @ centre_a
            yield motion
            trials += 1
            if trials == _MOST_TRIALS:
                return


def _frame(p: Floats, q: Floats) -> Floats:
    """Rotation (3, 3) with X along p and Y in the plane of p and q; any where they are along one line."""
    x = p / max(float(np.linalg.norm(p)), 1e-300)
    z = np.cross(x, q)
    if np.linalg.norm(z) < 1e-9 * max(float(np.linalg.norm(q)), 1e-300):
        z = np.cross(x, np.eye(3)[np.argmin(np.abs(x))])
    z = z / np.linalg.norm(z)
    return np.column_stack([x, np.cross(z, x), z])


def _matched(a: _Elements, b: _Elements, label: tuple[Ints, Ints], motion: Floats, tolerance: float) -> Ints | None:
    """The element of b where each element of a comes to lie, or None where one finds none of its kind."""
    from scipy.spatial import cKDTree

    def key(points: Floats, labels: Ints) -> Floats:
        ends = (points[:, 1] + points[:, 2]) / 2, np.linalg.norm(points[:, 1] - points[:, 2], axis=1)
        return np.column_stack([points[:, 0], *ends, labels * (10 * tolerance)])

    ours, theirs = key(apply(motion, a.points), label[0]), key(b.points, label[1])
    off, to = cKDTree(theirs).query(ours, distance_upper_bound=3 * tolerance)
    if not np.all(np.isfinite(off)):
        return None
    to = np.asarray(to, np.int64)
    # Each of b is reached too; several in one place stand for each other.
    if np.unique(to).size < to.size:
        back = cKDTree(ours).query(theirs, distance_upper_bound=3 * tolerance)[0]
        return to if np.all(np.isfinite(back)) else None
    return to


def _turned_about(a: _Elements, b: _Elements, to: Ints, motion: Floats) -> Floats:
    """Points of b in the order of a's elements, the ends of edges that run the other way exchanged."""
    points = b.points[to]
    moved = apply(motion, a.points)
    straight = np.linalg.norm(moved[:, 1:] - points[:, 1:], axis=2).max(axis=1)
    crossed = np.linalg.norm(moved[:, 1:] - points[:, :0:-1], axis=2).max(axis=1)
    return np.where((crossed < straight)[:, None, None], points[:, [0, 2, 1]], points)


def _best_motion(points: Floats, to: Floats) -> Floats:
    """Rotation and shift (4, 4) of least squares (Kabsch, Acta Cryst. A32, 1976)."""
    centre, centre_to = points.mean(axis=0), to.mean(axis=0)
    motion = np.eye(4)
    motion[:3, :3] = nearest_rotation((to - centre_to).T @ (points - centre))
    motion[:3, 3] = centre_to - motion[:3, :3] @ centre
    return motion
