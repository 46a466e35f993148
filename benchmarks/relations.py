"""Relations of units: how well they repeat in the other picture of a rendered pair, and what they tell partners from.

    RELMODEL_TEST_DATA=... python -m benchmarks.relations [--choose]

Partners: an arc of the left picture and one of the right along the same visible edge, as the edge's depth carries its
points over to within 3 px, at half of the points of the shorter one; each the best of the other.  Regions whose
intersection over union is at least .4 when every third pixel of the left is carried over by its depth, each the best of
the other.

Repeat: of the relations between two units of the left picture that both have a partner, the share that the partners
have too, whatever the values; `within reach` counts only those that a unit calls upon (`Tolerance.reach`).  Degree:
relations so found again, median over the left arcs with a partner.  Agree: the share found again within the tolerances
of `vision.relations.relations`, between true partners and where the first unit is given a wrong one: another unit of
its kind within 60 px of the right one, if an arc within 30 degrees of its direction.  What it tells, in nats, is the
logarithm of the ratio of the odds of these two shares.

Chosen on the pairs CHOOSING (`--choose` prints the tolerances that tell most there, as the divergence of Kullback
and Leibler between the two shares, in nats), reported on the others.
"""

import json
import os
import sys
from dataclasses import dataclass
from functools import cache
from itertools import product
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree
from tabulate import tabulate

from relmodel.arrays import Bools, Floats, Ints
from relmodel.geometry.transforms import apply, inverse
from vision.cameras.cameras import Camera
from vision.extraction.arcs import Arcs
from vision.extraction.extract import Extraction, extract
from vision.relations.relations import AGREE, KINDS, TOLERANCES, Relations, Tolerance

CHOOSING = (("A", 0), ("A", 2), ("A", 5), ("A", 7), ("B", 0), ("C", 0), ("C", 3))
REPORTED = (("A", 1), ("A", 3), ("A", 4), ("A", 6), ("B", 1), ("C", 1), ("C", 2))


@dataclass(frozen=True)
class Pair:
    """Two extractions and of each unit of the left one its partner in the right one, -1 for none."""

    left: Extraction
    right: Extraction
    partner: Ints


@dataclass(frozen=True)
class Carried:
    """Relations (m,) of the left picture between units that have partners, and how they fare on the right.

    `of_arcs`: both are; `distance`: what it is; `distance_off`, `angle_off`: by how much those of the labels differ,
    NaN where these have no such relation.
    """

    kind: npt.NDArray[np.int8]
    unit: Ints
    neighbour: Ints
    of_arcs: Bools
    distance: Floats
    distance_off: Floats
    angle_off: Floats

    def agree(self, tolerance: Tolerance) -> Bools:
        """Whether the labels have the relation, its values within AGREE standard deviations."""
        sigma = tolerance.distance + tolerance.distance_share * np.abs(self.distance)
        return np.asarray((self.distance_off <= AGREE * sigma) & (self.angle_off <= AGREE * tolerance.angle))

    def take(self, kept: Bools) -> "Carried":
        """The relations that the mask selects."""
        return Carried(*(column[kept] for column in vars(self).values()))


@cache
def read_pair(data: Path, part: str, number: int) -> Pair:
    """Extract both pictures of a rendered pair and find the partners."""
    stem = f"{data}/bulkhead/{part}/pairs/pair_{number:02d}"
    left, right = (
        extract(np.asarray(cv2.imread(f"{stem}_{name}.png", cv2.IMREAD_GRAYSCALE))) for name in ("left", "right")
    )
    truth = json.loads(Path(f"{stem}_truth.json").read_text())
    cameras = [Camera(1280, 960, np.array(truth["cameras"][name]["K"])) for name in ("left", "right")]
    right_from_left = inverse(np.array(truth["T_left_right"]))

    def carry(place: Floats, depth: Floats) -> Floats:
        rays = np.column_stack([place, np.ones(len(place))]) @ np.linalg.inv(cameras[0].matrix).T
        return np.asarray(cameras[1].project(apply(right_from_left, rays * depth[:, None]))[0])

    with np.load(f"{stem}_left_edges.npz") as edges:
        place, depth = edges["uv"].astype(np.float64), edges["z"].astype(np.float64)
        moved = carry(place, depth) - place
        arcs = find_arc_partners(left.arcs, right.arcs, place, moved, edges["normal2d"].astype(np.float64))
    depths = np.asarray(cv2.imread(f"{stem}_left_depth.png", cv2.IMREAD_UNCHANGED), np.float64) / 10
    row, column = (index[::3] for index in np.nonzero(depths > 0))
    there = np.rint(carry(np.column_stack([column, row]).astype(np.float64), depths[row, column])).astype(np.int64)
    seen = np.all((there >= 0) & (there < (1280, 960)), axis=1)
    one = left.regions.labels[row[seen], column[seen]].astype(np.int64)
    other = right.regions.labels[there[seen, 1], there[seen, 0]].astype(np.int64)
    regions = find_region_partners(left.regions.area, right.regions.area, one, other)
    return Pair(left, right, np.concatenate([arcs, np.where(regions >= 0, len(right.arcs) + regions, -1)]))


def find_arc_partners(left: Arcs, right: Arcs, place: Floats, moved: Floats, normal: Floats) -> Ints:
    """The right arc of each left one, -1 for none; `place` (k, 2) of samples of visible edges in the left picture, by
    how much they have `moved` in the right one, and their normals."""
    points, tangents, owner = _walk(left)
    other_points, other_tangents, other_owner = _walk(right)
    distance, near = cKDTree(place).query(points, k=4, distance_upper_bound=2.0)
    near = np.minimum(near, len(place) - 1)
    good = np.isfinite(distance) & (np.abs(np.einsum("ij,ikj->ik", tangents, normal[near])) < 0.4)
    on_edge = good.any(axis=1)
    nearest = near[np.arange(len(near)), np.argmax(good, axis=1)][on_edge]
    distance, near = cKDTree(other_points).query(points[on_edge] + moved[nearest], k=8, distance_upper_bound=3.0)
    near = np.minimum(near, len(other_points) - 1)
    alike = np.abs(np.einsum("ij,ikj->ik", tangents[on_edge], other_tangents[near])) > 0.9
    point, which = np.nonzero(np.isfinite(distance) & alike)
    met = np.unique(np.column_stack([point, other_owner[near[point, which]]]), axis=0)
    agreed = np.zeros((len(left), len(right)))
    np.add.at(agreed, (owner[on_edge][met[:, 0]], met[:, 1]), 1.0)
    shorter = np.minimum(left.chains.counts[:, None], right.chains.counts[None])
    return _best_of_each_other(np.where(agreed >= 0.5 * shorter, agreed, 0.0))


def _walk(arcs: Arcs) -> tuple[Floats, Floats, Ints]:
    """Points of all arcs, unit tangents from three points before to three after, and the arc of each."""
    owner = arcs.chains.chain_of_member
    point = np.arange(len(owner))
    before, after = np.maximum(point - 3, arcs.offsets[owner]), np.minimum(point + 3, arcs.offsets[owner + 1] - 1)
    points = np.column_stack([arcs.x, arcs.y])
    along = points[after] - points[before]
    return points, along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9), owner


def find_region_partners(left: Floats, right: Floats, one: Ints, other: Ints) -> Ints:
    """The right region of each left one, -1 for none, from their areas and the labels of pixels, of which each third
    was taken."""
    shared = np.zeros((len(left), len(right)))
    labelled = (one >= 0) & (other >= 0)
    np.add.at(shared, (one[labelled], other[labelled]), 3.0)
    overlap = shared / np.maximum(left[:, None] + right[None] - shared, 1.0)
    return _best_of_each_other(np.where(overlap >= 0.4, overlap, 0.0))


def _best_of_each_other(score: Floats) -> Ints:
    best = score.argmax(axis=1)
    mutual = (score.max(axis=1) > 0) & (score.argmax(axis=0)[best] == np.arange(len(score)))
    return np.where(mutual, best, -1)


def carry_relations(pair: Pair, *, wrong: bool = False) -> Carried:
    """The left picture's relations between units with partners, looked up between the partners; with `wrong`, each once
    for every wrong label of its first unit."""
    relations, other = pair.left.relations, pair.right.relations
    kept = (pair.partner[relations.a] >= 0) & (pair.partner[relations.b] >= 0)
    row = np.flatnonzero(kept)
    label, second = pair.partner[relations.a[row]], pair.partner[relations.b[row]]
    if wrong:
        of, mistaken = find_wrong_labels(pair.right)
        first, last = np.searchsorted(of, label), np.searchsorted(of, label, side="right")
        again = np.repeat(np.arange(len(row)), last - first)
        nth = np.arange(len(again)) - np.repeat(np.cumsum(last - first) - (last - first), last - first)
        label = mistaken[first[again] + nth]
        row, second = row[again], second[again]
        apart = label != second
        row, label, second = row[apart], label[apart], second[apart]
    distance, angle = _look_up(
        other, relations.kind[row], label, second, len(pair.right.arcs) + len(pair.right.regions)
    )
    turn = np.abs(relations.angle[row] - angle)
    return Carried(
        relations.kind[row],
        relations.a[row].astype(np.int64),
        relations.b[row].astype(np.int64),
        np.maximum(relations.a, relations.b)[row] < len(pair.left.arcs),
        relations.distance[row],
        np.abs(relations.distance[row] - distance),
        np.minimum(turn, 2 * np.pi - turn),
    )


def _look_up(
    relations: Relations, kind: npt.NDArray[np.integer], a: Ints, b: Ints, units: int
) -> tuple[Floats, Floats]:
    """Distance and angle of the relations of those kinds between units a and b, NaN where there is none."""
    key = (relations.kind.astype(np.int64) * units + relations.a) * units + relations.b
    order = np.argsort(key)
    wanted = (kind.astype(np.int64) * units + a) * units + b
    at = order[np.minimum(np.searchsorted(key, wanted, sorter=order), len(key) - 1)]
    found = key[at] == wanted
    return np.where(found, relations.distance[at], np.nan), np.where(found, relations.angle[at], np.nan)


def find_wrong_labels(found: Extraction) -> tuple[Ints, Ints]:
    """Pairs of units of a picture, ascending by the first, of which the second might be taken for the first: of one
    kind, near to each other, and arcs of like direction."""
    arcs = found.arcs
    place = [np.column_stack([arcs.x, arcs.y]), np.column_stack([found.regions.outline_x, found.regions.outline_y])]
    of_vertex = np.repeat(found.regions.ring_region, np.diff(found.regions.ring_offsets))
    owner = [arcs.chains.chain_of_member, len(arcs) + of_vertex.astype(np.int64)]
    parts = []
    for points, unit in zip(place, owner, strict=True):
        near = cKDTree(points[::4]).query_pairs(60.0, output_type="ndarray")
        pair = unit[::4][near]
        parts.append(np.unique(np.concatenate([pair, pair[:, ::-1]]), axis=0))
    both = np.concatenate(parts)
    first, second = both[both[:, 0] != both[:, 1]].T
    of_arcs = first < len(arcs)
    direction = np.vstack([arcs.direction, np.ones((len(found.regions), 2))])
    alike = np.abs(np.sum(direction[first] * direction[second], axis=1)) > np.cos(np.radians(30))
    return first[alike | ~of_arcs], second[alike | ~of_arcs]


def tell(true: float, false: float) -> float:
    """Divergence (nats) between what is confirmed in a share `true` and in a share `false` of cases."""
    p, q = np.clip([true, false], 0.005, 0.995)
    return float(p * np.log(p / q) + (1 - p) * np.log((1 - p) / (1 - q)))


def weigh(true: float, false: float) -> float:
    """The logarithm of the ratio of the odds."""
    p, q = np.clip([true, false], 0.005, 0.995)
    return float(np.log(p / (1 - p)) - np.log(q / (1 - q)))


def _concatenate(parts: list[Carried]) -> Carried:
    return Carried(*(np.concatenate([getattr(part, name) for part in parts]) for name in vars(parts[0])))


def report(data: Path, which: tuple[tuple[str, int], ...]) -> None:
    """Repeat and agreement by kind."""
    pairs = [read_pair(data, *name) for name in which]
    each = [carry_relations(pair) for pair in pairs]
    true, false = _concatenate(each), _concatenate([carry_relations(pair, wrong=True) for pair in pairs])
    rows = []
    for kind, of_arcs in (("near", True), ("near", False), *((kind, None) for kind in KINDS[1:])):
        code, tolerance = KINDS.index(kind), TOLERANCES[kind]
        known, mistaken = (
            part.take((part.kind == code) & (of_arcs is None or part.of_arcs == of_arcs)) for part in (true, false)
        )
        called, wrongly = (part.take(np.abs(part.distance) <= tolerance.reach) for part in (known, mistaken))
        right, error = (float(np.mean(part.agree(tolerance))) for part in (called, wrongly))
        again = [np.mean(np.isfinite(part.distance_off)) for part in (known, called)]
        off = [np.nanquantile(values, (0.5, 0.9)) for values in (called.distance_off, called.angle_off)]
        name = kind if of_arcs is None else kind + (" (arcs)" if of_arcs else " (regions)")
        rows.append(
            [name, len(known.unit), *again, *off[0], *off[1], right, error, weigh(right, error), tolerance.nats]
        )
    headers = ["kind", "of partners", "repeat", "in reach", "distance off", ".9", "angle off", ".9"]
    headers += ["true agree", "wrong agree", "nats", "used"]
    print(tabulate(rows, headers=headers, floatfmt=("", ".0f", *[".2f"] * 2, *[".1f"] * 2, *[".2f"] * 4)), "\n")

    reach = np.array([TOLERANCES[kind].reach for kind in KINDS])
    found: dict[str, list[Ints]] = {"near": [], "near, in reach": [], "any, in reach": [], "any that agrees": []}
    for pair, part in zip(pairs, each, strict=True):
        within = np.isfinite(part.distance_off) & (np.abs(part.distance) <= reach[part.kind])
        agree = np.any([(part.kind == k) & part.agree(TOLERANCES[kind]) for k, kind in enumerate(KINDS)], axis=0)
        near = part.kind == KINDS.index("near")
        masks = (near & np.isfinite(part.distance_off), near & within, within, within & agree)
        arcs = np.flatnonzero(pair.partner[: len(pair.left.arcs)] >= 0)
        for name, mask in zip(found, masks, strict=True):
            neighbours = np.unique(np.column_stack([part.unit, part.neighbour])[mask], axis=0)
            found[name].append(np.bincount(neighbours[:, 0], minlength=len(pair.partner))[arcs])
    degrees = [np.median(np.concatenate(values)) for values in found.values()]
    print(tabulate([["median degree", *degrees]], headers=["", *found]), "\n")
    called = true.take(np.abs(true.distance) <= reach[true.kind])
    shares = [np.mean(np.isfinite(part.distance_off)) for part in (true, called)]
    total = np.mean([len(pair.left.relations) + len(pair.right.relations) for pair in pairs])
    print(f"{total:.0f} relations a pair; of all kinds repeat {shares[0]:.3f}, in reach {shares[1]:.3f}\n")


def choose(data: Path) -> None:
    """The tolerances of each kind that tell most, within the reach of those used."""
    pairs = [read_pair(data, *name) for name in CHOOSING]
    true = _concatenate([carry_relations(pair) for pair in pairs])
    false = _concatenate([carry_relations(pair, wrong=True) for pair in pairs])
    rows = []
    for code, kind in enumerate(KINDS):
        reach = TOLERANCES[kind].reach
        own, other = (part.take((part.kind == code) & (np.abs(part.distance) <= reach)) for part in (true, false))
        told = []
        for d, share, angle in product(
            (1.5, 3.0, 4.5, 6.0, 9.0, 12.0, 18.0, 30.0),
            (0.0, 0.075, 0.15, 0.225, 0.375),
            (0.075, 0.1125, 0.15, 0.225, 0.3, 0.45),
        ):
            tried = Tolerance(d, share, angle, reach, 1.0)
            shares = float(np.mean(own.agree(tried))), float(np.mean(other.agree(tried)))
            told.append((tell(*shares), d, share, angle, *shares, weigh(*shares)))
        rows += [[kind, *row] for row in sorted(told, reverse=True)[:3]]
    print(
        tabulate(rows, headers=["kind", "nats", "px", "share", "rad", "true", "wrong", "log odds"], floatfmt=".3g"),
        "\n",
    )


def main() -> None:
    data = Path(os.environ["RELMODEL_TEST_DATA"])
    if "--choose" in sys.argv:
        choose(data)
        report(data, CHOOSING)
    report(data, REPORTED)


if __name__ == "__main__":
    main()
