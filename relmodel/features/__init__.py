"""Machined features of a shape, found in its attributed adjacency graph.

Holes come first, because their shape is the surest.  Surfaces that one kind has taken are closed to the kinds after it:
lugs, pockets and slots, ribs, flanges and webs, open slots and steps, openings, bosses, chamfers, fillets, patterns of
holes, and the body, which is all that is left."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from relmodel.features import blends, protrusions, slots, thin
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.features.graph import Boundary, Feature, boundary, feature_class_key, lengths, union
from relmodel.features.holes import holes, patterns
from relmodel.features.hollows import openings, pockets
from relmodel.geometry.curves import vectors
from relmodel.geometry.transforms import rigid
from relmodel.model.model import Shape

__all__ = ["Feature", "feature_class_key", "recognise"]

_ALL = DEFAULTS.common


def recognise(shape: Shape) -> list[Feature]:
    """Features of a shape by kind, each kind in the order of its first surface; its name is its kind and its number in
    that order.

    A mesh of more than 20,000 surfaces is a scan and not a tessellated part: no features are looked for in it."""
    if len(shape.mesh.triangles) == 0 or (
        shape.kind == "mesh" and len(shape.surfaces["kind"]) > _ALL.most_mesh_surfaces
    ):
        return []
    b = boundary(shape)
    b.blends = blends.rounded(b)
    bevels = blends.bevelled(b)
    b.chamfers = set(bevels)
    found = holes(b.surfaces, b.links)
    features = list(found)
    if b.sides:
        rings, beyond = protrusions.grooves(b, found)
        found = [hole for hole in found if not _surfaces([hole]) <= _surfaces(rings)]
        features = [*found, *rings, *_of_faces(b, shape, found, rings, beyond)]
        taken = _surfaces(features)
        features += blends.chamfers(b, {i: f for i, f in bevels.items() if i not in taken})
        features += blends.fillets(b, _surfaces(features))
    features += patterns(found)
    features += _body(b, _surfaces(features))
    counts: dict[str, int] = {}
    for feature in features:
        counts[feature.kind] = counts.get(feature.kind, 0) + 1
        feature.name = f"{feature.kind} {counts[feature.kind]}"
        feature.surfaces = sorted((i, role) for merged, role in feature.surfaces for i in b.merged_faces[merged])
    return features


def _of_faces(
    b: Boundary, shape: Shape, found: list[Feature], rings: list[Feature], beyond: dict[int, int]
) -> list[Feature]:
    """Features that need the loops of the faces: a shape without them (a mesh) has only holes and patterns."""
    bored = _surfaces([*found, *rings])
    lugs = protrusions.lugs(b, found)
    hollows = pockets(b, bored)
    straight = np.asarray(shape.arcs["recognised_kind"], dtype=str) == "line"
    direction = vectors(shape.arcs, "axis_x")
    pairs = thin.opposed(b, np.where(straight[:, None], direction, np.nan))
    floors = _surfaces(hollows, "floor")
    standing = thin.ribs(b, pairs, floors, bored | _surfaces(lugs))
    sides = _surfaces(standing)
    discs = protrusions.shaft_flanges(b, set(beyond))
    through = openings(b, bored | _surfaces(hollows))
    open_ = slots.open_depressions(b, bored | _surfaces([*hollows, *through, *lugs]), sides, thin.gussets(b, standing))
    # The floor of an open slot may have looked like the side of a rib.
    floors |= _surfaces(open_, "floor")
    standing = [f for f in standing if not floors & _surfaces([f])]
    webs = thin.webs(b, pairs, [*hollows, *(f for f in open_ if f.kind == "open_slot")])
    bosses = protrusions.bosses(b, bored, _surfaces(standing) | _surfaces(lugs), beyond)
    return [*hollows, *open_, *through, *standing, *webs, *bosses, *lugs, *discs]


def _surfaces(features: Iterable[Feature], wanted: str = "") -> set[int]:
    return {i for feature in features for i, role in feature.surfaces if role == (wanted or role)}


def _body(b: Boundary, taken: set[int]) -> list[Feature]:
    """All surfaces that are of no feature, as one; its frame is that of the shape, moved to the middle."""
    rest = sorted(set(range(len(b.surfaces.kind))) - taken)
    if not rest:
        return []
    box = union(b.surfaces.boxes[rest])
    size, pose = box[3:] - box[:3], rigid(np.eye(3), (box[:3] + box[3:]) / 2)
    measures = lengths(length=size[0], width=size[1], height=size[2])
    return [Feature("body", "", measures, pose, box, [(i, "body") for i in rest])]
