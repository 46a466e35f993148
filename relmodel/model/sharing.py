"""Shapes of a file that are one shape in several places: sharing that a flattened file has lost, found again.

Their faces and edges, with kinds, areas, radii, lengths and convexities, come to lie on each other to round-off.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.geometry.congruence import Elements, motions
from relmodel.geometry.curves import vectors
from relmodel.geometry.surfaces import ANALYTIC_KINDS
from relmodel.model.measures import curves_of, surfaces_of
from relmodel.model.model import Model, Shape

# Round-off of a file's digits: mm, and of the extent of a shape.
ROUND_OFF_MM = 2e-6
ROUND_OFF_SHARE = 1e-9


@dataclass
class Congruence:
    """Motion that takes one shape to another, and which of its faces and edges each of the other's is."""

    motion: Floats  # (4, 4)
    surfaces: Ints
    arcs: Ints


def share(model: Model) -> Model:
    """The model in which parts of congruent shapes have the first of these, placed by the motion.

    The frame of such a part becomes that of the first; shapes that no part has any more are dropped.
    """
    of, motion, like = _classes(model.shapes)
    if np.array_equal(of, np.arange(len(of))):
        return model
    left = np.unique(of)
    number = {int(shape): i for i, shape in enumerate(left)}
    assemblies = tuple(
        replace(
            assembly,
            instances=tuple(
                replace(one, parent_from_child=one.parent_from_child @ motion[model.parts[one.child].shape])
                if one.kind == "part"
                else one
                for one in assembly.instances
            ),
        )
        for assembly in model.assemblies
    )
    parts = []
    for part in model.parts:
        pmi = part.pmi
        if part.shape in like:
            there = {theirs: ours for ours, theirs in reversed(list(enumerate(like[part.shape].tolist())))}
            pmi = tuple(replace(p, surfaces=tuple((there[s], role) for s, role in p.surfaces)) for p in pmi)
        parts.append(replace(part, pmi=pmi, shape=number[int(of[part.shape])]))
    shapes = tuple(model.shapes[i] for i in left.tolist())
    return replace(model, shapes=shapes, parts=tuple(parts), assemblies=assemblies)


def _classes(shapes: Sequence[Shape]) -> tuple[Ints, Floats, dict[int, Ints]]:
    """The first shape that each (n,) is congruent to, the motions (n, 4, 4) from there, and of a shape that is not
    itself the first which of its faces each face of the first is."""
    of, motion = np.arange(len(shapes)), np.tile(np.eye(4), (len(shapes), 1, 1))
    like: dict[int, Ints] = {}
    firsts: dict[tuple[str, ...], list[int]] = {}
    elements: dict[int, Elements] = {}
    for i, shape in enumerate(shapes):
        if not shape.surfaces or not shape.arcs or "fitted" in shape.surfaces["provenance"]:
            continue
        alike = firsts.setdefault(_counts(shape), [])
        for first in alike:
            for k in (first, i):
                if k not in elements:
                    elements[k] = _elements(shapes[k])
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
    return _fit(_elements(first), _elements(other))


def _elements(shape: Shape) -> Elements:
    """Faces, then edges, of a shape."""
    s, a = shape.surfaces, shape.arcs
    surfaces, curves = surfaces_of(shape), curves_of(shape)
    n = len(surfaces)
    centroid, area = vectors(s, "centroid"), np.asarray(s["area"], float)
    # A free-form face has more to it than its area and its boundary: a point amid its domain.
    amid = surfaces.evaluate(np.arange(n), *surfaces.domain.reshape(-1, 2, 2).mean(axis=2).T).points
    amid[np.isin(surfaces.kind.astype(str), ANALYTIC_KINDS)] = np.nan
    amid = np.where(np.isnan(amid), centroid, amid)
    middle = curves.evaluate(np.arange(len(curves)), (curves.t0 + curves.t1) / 2)[0]
    length = np.asarray(a["length"], float)
    points = np.concatenate(
        [np.stack([centroid, amid, amid], axis=1), np.stack([middle, vectors(a, "start"), vectors(a, "end")], axis=1)]
    )
    sizes = np.concatenate(
        [
            np.column_stack([np.sqrt(area), surfaces.radius, surfaces.radius2]),
            np.column_stack([length, curves.radius, curves.radius2]),
        ]
    )
    weight = np.zeros((len(points), 3))
    weight[:n, 0], weight[:n, 1], weight[n:, 2] = area, area**2, length
    return Elements([*_face_kinds(shape), *_edge_kinds(shape)], np.nan_to_num(sizes), points, weight)


def _fit(a: Elements, b: Elements) -> Congruence | None:
    """The motion that takes the elements a to the elements b within round-off."""
    within = ROUND_OFF_MM + ROUND_OFF_SHARE * a.extent
    found = next(motions(a, b, within, 20 * within), None)
    if found is None:
        return None
    faces = sum(kind.startswith("face") for kind in a.kind)
    return Congruence(found[0], found[1][:faces], found[1][faces:] - faces)


def _face_kinds(shape: Shape) -> list[str]:
    s = shape.surfaces
    labels = [s[c] for c in ("kind", "name", "colour", "layer", "finish") if c in s]
    return ["face|" + "|".join(map(str, row)) for row in zip(*labels, strict=True)]


def _edge_kinds(shape: Shape) -> list[str]:
    return ["edge|" + "|".join(row) for row in zip(shape.arcs["kind"], shape.arcs["convexity"], strict=True)]
