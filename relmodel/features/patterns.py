"""Patterns of equal holes: bolt circles, rows and grids."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.features.feature import Feature, feature_class_key, lengths, outline_form
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.frames import frame, union
from relmodel.geometry.clusters import clusters

if TYPE_CHECKING:
    from scipy.spatial import cKDTree


_P = DEFAULTS.patterns


def patterns(holes: list[Feature]) -> list[Feature]:
    """Holes of one class with mouths in one plane, evenly spaced on a circle, a line or a rectangular grid.

    Each hole counts once: circles of five and more first, then grids of six and more, rows, smaller circles, and last
    the corners of rectangles; of each the one of most holes first.  A circle of five and more may have gaps.
    """
    groups: dict[str, list[int]] = {}
    for i, hole in enumerate(holes):
        groups.setdefault(feature_class_key(hole), []).append(i)
    found = []
    for members in groups.values():
        if len(members) < _P.least:
            continue
        z = np.array([holes[i].shape_from_feature[:3, 2] for i in members])
        at = np.array([holes[i].shape_from_feature[:3, 3] for i in members])
        label = clusters(np.column_stack([z * 1e3, np.sum(z * at, axis=1)]), _P.same)
        for k in range(int(label.max()) + 1):
            own = np.flatnonzero(label == k)
            if len(own) >= _P.least:
                found += _in_plane([holes[members[i]] for i in own.tolist()])
    return found


def _in_plane(holes: list[Feature]) -> list[Feature]:
    from scipy.spatial import cKDTree

    pose = holes[0].shape_from_feature
    at = np.array([h.shape_from_feature[:3, 3] for h in holes])
    flat = (at - pose[:3, 3]) @ pose[:3, :2]
    tree = cKDTree(flat)
    found, free = [], np.ones(len(holes), bool)
    rounds = sorted(_circles(flat, tree), key=lambda c: (-len(c), c))
    rows = sorted(_rows(flat, tree), key=lambda r: (-len(r), float(np.linalg.norm(flat[r[1]] - flat[r[0]])), r))
    large = [c for c in rounds if len(c) >= _P.surely_a_circle]
    small = [c for c in rounds if len(c) < _P.surely_a_circle]
    grids = sorted(_grids(flat, tree), key=lambda g: (-g.size, g.ravel().tolist()))
    for kind, candidates in (
        ("circular_pattern", large),
        ("grid_pattern", [g.ravel().tolist() for g in grids if g.size > 4]),
        ("linear_pattern", rows),
        ("circular_pattern", small),
        ("grid_pattern", [g.ravel().tolist() for g in grids if g.size == 4]),
    ):
        for members in candidates:
            if free[members].all():
                free[members] = False
                shape = next((g.shape for g in grids if g.ravel().tolist() == members), (1, len(members)))
                found.append(_pattern(kind, [holes[i] for i in members], shape))
    return found


def _nearest(flat: Floats, tree: cKDTree) -> list[list[int]]:
    count = min(_P.nearest + 1, len(flat))
    _, nearest = tree.query(flat, k=count)
    return [[j for j in row if j != i] for i, row in enumerate(np.asarray(nearest).tolist())]


def _at(tree: cKDTree, places: Floats) -> list[int] | None:
    """Rows of the points at places (n, 2); None where one is empty."""
    members = _among(tree, places)
    return members if len(members) == len(places) else None


def _among(tree: cKDTree, places: Floats) -> list[int]:
    """Rows of the points that are at some of the places (n, 2)."""
    away, row = tree.query(places)
    found: list[int] = np.asarray(row)[away < _P.same].tolist()
    return found


def _circles(flat: Floats, tree: cKDTree) -> list[list[int]]:
    """Circles on which some point has two neighbours at equal chords, and every place is taken, or most of many."""
    found: set[tuple[int, ...]] = set()
    for i, nearest in enumerate(_nearest(flat, tree)):
        for n, j in enumerate(nearest):
            for k in nearest[n + 1 :]:
                p, q = flat[j] - flat[i], flat[k] - flat[i]
                a, c = float(np.linalg.norm(p)), float(np.linalg.norm(q))
                cross = float(p[0] * q[1] - p[1] * q[0])
                if abs(a - c) > _P.same or abs(cross) < 1e-3 * a * c:
                    continue
                # The angle at the point is that of a regular polygon of `count` corners.
                turn = np.pi - np.arccos(np.clip(p @ q / (a * c), -1, 1))
                count = round(2 * np.pi / turn)
                if count < _P.least or _P.filled * count > len(flat) or abs(turn * count - 2 * np.pi) > 1e-3 * count:
                    continue
                middle = flat[i] + (p + q) / np.linalg.norm(p + q) * a / (2 * np.sin(np.pi / count))
                arm = flat[i] - middle
                t = 2 * np.pi * np.arange(count) / count
                turned = np.outer(np.cos(t), arm) + np.outer(np.sin(t), [-arm[1], arm[0]])
                members = tuple(sorted(set(_among(tree, middle + turned))))
                if len(members) == count or len(members) >= max(_P.surely_a_circle, _P.filled * count):
                    found.add(members)
    return [list(c) for c in sorted(found)]


def _rows(flat: Floats, tree: cKDTree) -> list[list[int]]:
    """Longest runs of points at equal steps."""
    found: set[tuple[int, ...]] = set()
    for i, nearest in enumerate(_nearest(flat, tree)):
        for j in nearest:
            step = flat[j] - flat[i]
            if tuple(np.round(step, 3)) < (0.0, 0.0) or _at(tree, (flat[i] - step)[None]) is not None:
                continue
            run = [i, j]
            while (more := _at(tree, (flat[i] + len(run) * step)[None])) is not None:
                run += more
            if len(run) >= _P.least:
                found.add(tuple(run))
    return [list(r) for r in sorted(found)]


def _grids(flat: Floats, tree: cKDTree) -> list[Ints]:
    """Points at the crossings of two sets of even lines at right angles: rows, no more than columns, of points."""
    found: dict[tuple[int, ...], Ints] = {}
    for i, nearest in enumerate(_nearest(flat, tree)):
        for j in nearest:
            a = flat[j] - flat[i]
            length = float(np.linalg.norm(a))
            if length < _P.same or _at(tree, (flat[i] - a)[None]) is not None:
                continue
            # The next line is that of the nearest point square to the first.
            arm = flat - flat[i]
            square = (np.abs(arm @ a) < _P.same * length) & (arm @ [-a[1], a[0]] > _P.same * length)
            if not square.any():
                continue
            b = arm[min(np.flatnonzero(square).tolist(), key=lambda k: float(np.linalg.norm(arm[k])))]
            counts = [_run(flat, tree, i, step) for step in (a, b)]
            places = flat[i] + np.arange(counts[1])[:, None, None] * b + np.arange(counts[0])[None, :, None] * a
            members = _at(tree, places.reshape(-1, 2))
            if members is None or min(counts) < 2 or len(set(members)) < len(members):
                continue
            grid = np.array(members).reshape(counts[1], counts[0])
            turned = counts[1] > counts[0] or (counts[1] == counts[0] and np.linalg.norm(b) > length + _P.same)
            found.setdefault(tuple(sorted(members)), grid.T if turned else grid)
    return list(found.values())


def _run(flat: Floats, tree: cKDTree, start: int, step: Floats) -> int:
    """Number of points in even steps from one."""
    count = 1
    while count <= len(flat) and _at(tree, (flat[start] + count * step)[None]) is not None:
        count += 1
    return count


def _centre(at: Floats) -> Floats:
    """Centre of the circle that points (n, 3) of one plane, which holds the origin, lie on."""
    squares = np.sum(at * at, axis=1)
    out: Floats = np.linalg.lstsq(2 * (at - at[0]), squares - squares[0], rcond=1e-9)[0]
    return out


def _pattern(kind: str, holes: list[Feature], shape: tuple[int, ...]) -> Feature:
    z = holes[0].shape_from_feature[:3, 2]
    at = np.array([h.shape_from_feature[:3, 3] for h in holes])
    centre = at.mean(axis=0)
    if kind == "circular_pattern":
        centre = centre + _centre(at - centre)
        x = at[0] - centre
        measures = lengths(pattern_diameter=2 * float(np.linalg.norm(x)))
    else:
        x = at[1] - at[0]
        measures = lengths(pitch=float(np.linalg.norm(x)))
    if kind == "grid_pattern":
        rows, columns = shape
        measures |= lengths(row_pitch=float(np.linalg.norm(at[columns] - at[0])))
        measures |= {"rows": (float(rows), "1"), "columns": (float(columns), "1")}
    measures |= lengths(hole_diameter=holes[0].dimensions["diameter"][0])
    box = union(np.array([h.box for h in holes]))
    surfaces = sorted({i for h in holes for i, _ in h.surfaces})
    dimensions = {"count": (float(len(holes)), "1"), **measures}
    pose = frame(x, z, centre)
    form = _form_with_gaps(at, pose) if kind == "circular_pattern" else ()
    return Feature(kind, "", dimensions, pose, box, [(i, "hole") for i in surfaces], form)


def _form_with_gaps(at: Floats, pose: Floats) -> tuple[float, ...]:
    """The form of a circle of holes (n, 3) some places of which are empty; of an even one nothing."""
    local = (at - pose[:3, 3]) @ pose[:3, :2]
    angle = np.sort(np.arctan2(local[:, 1], local[:, 0]))
    even = np.ptp(np.diff(angle, append=angle[0] + 2 * np.pi)) < _P.same
    return () if even else outline_form(at, ["hole"] * len(at), pose, either_way=False)
