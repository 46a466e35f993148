"""Relations of circles in space, two by two: the constellations by which a body is found again.

A relation is what rigid motions and mirroring leave unchanged of two circles: both radii, the distance of the centres,
the cosines of the angles between the normals and between each normal and the line of the centres.  Normals have no
sense.  Relations that agree are one class; of a class that repeats through a body only some pairs are kept.
"""

from __future__ import annotations

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.columns import Ragged
from relmodel.features.feature_parameters import DEFAULTS as FEATURES
from relmodel.features.feature_parameters import CircleParameters

DEFAULTS = FEATURES.circles


def relate(centre: Floats, normal: Floats, radius: Floats, a: Ints, b: Ints) -> dict[str, Floats]:
    """The relations of circles `a` (k,) with `b` (k,) of centre (n, 3) mm, unit normal (n, 3) and radius (n,) mm."""
    line = centre[b] - centre[a]
    distance = np.linalg.norm(line, axis=1)
    line = line / np.maximum(distance, 1e-12)[:, None]
    return {
        "radius_a": radius[a],
        "radius_b": radius[b],
        "distance": distance,
        "normals": np.abs(np.einsum("ij,ij->i", normal[a], normal[b])),
        "rise_a": np.abs(np.einsum("ij,ij->i", normal[a], line)),
        "rise_b": np.abs(np.einsum("ij,ij->i", normal[b], line)),
    }


def classify(
    centre: Floats, normal: Floats, radius: Floats, p: CircleParameters = DEFAULTS
) -> tuple[dict[str, Floats | Ints], Ragged]:
    """Columns of `circle_relation`, without the object's identity, of circles that stay together; and its `circles`."""
    from scipy.spatial import cKDTree

    near = cKDTree(centre).query_pairs(p.greatest_distance, output_type="ndarray").reshape(-1, 2).astype(np.int64)
    near = near[np.lexsort((near[:, 1], near[:, 0]))]
    values = relate(centre, normal, radius, *near.T)
    # The smaller circle comes first; of equals the one whose normal leans less on the line.
    first, second = (
        np.stack([np.round(values[f"{n}_a"], 2), np.round(values[f"{n}_b"], 2)]) for n in ("radius", "rise")
    )
    turned = (first[0] > first[1]) | ((first[0] == first[1]) & (second[0] > second[1]))
    near[turned] = near[turned][:, ::-1]
    near = near[values["distance"] >= p.least_distance]
    values = relate(centre, normal, radius, *near.T)
    steps = dict.fromkeys(values, p.cosine_step) | {"distance": p.distance_step}
    steps |= {"radius_a": p.radius_step, "radius_b": p.radius_step}
    cell = np.stack([np.rint(values[n] / steps[n]).astype(np.int64) for n in values])
    order = np.lexsort(cell[::-1])
    is_first = (np.diff(cell[:, order], prepend=-1) != 0).any(axis=0)
    class_of = np.cumsum(is_first) - 1
    pairs = np.bincount(class_of)
    means = {name: np.bincount(class_of, v[order], len(pairs)) / pairs for name, v in values.items()}
    # Finer than any tolerance; a column of round numbers takes half the room.
    means = {name: np.round(v, 2 if name == "distance" else 4) for name, v in means.items()}
    kept = _thin(class_of, pairs, p.most_of_class)
    of = np.tile(class_of[kept], 2)  # of the smaller circles, then of the greater
    by_class = np.argsort(of, kind="stable")
    circles = Ragged(near[order[kept]].T.ravel()[by_class], np.searchsorted(of[by_class], np.arange(len(pairs) + 1)))
    return {"class_no": np.arange(len(pairs)), "pairs": pairs, **means}, circles


def select_rare(radius: Floats, p: CircleParameters = DEFAULTS) -> Ints:
    """Rows of circles (n,), increasing: of too many for all to be related, those whose radius (mm) is rarest."""
    _, of, count = np.unique(np.rint(radius / p.radius_step), return_inverse=True, return_counts=True)
    return np.sort(np.argsort(count[of.ravel()], kind="stable")[: p.most_circles])


def _thin(class_of: Ints, pairs: Ints, most: int) -> Ints:
    """Of rows in the order of their classes (n,) at most so many of each, taken evenly."""
    place = np.arange(len(class_of)) - np.repeat(np.cumsum(pairs) - pairs, pairs)
    count = pairs[class_of]
    return np.flatnonzero((count <= most) | ((place + 1) * most // count > place * most // count))
