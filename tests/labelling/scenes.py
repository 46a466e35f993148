"""Generated matching problems: short arcs in a plane, seen again with some dropped, all moved and clutter added."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Floats, Ints
from relmodel.labelling.problem import NONE, MatchingProblem, matching_problem

PITCH = 90.0
POCKET = 8  # arcs in each of the pockets that repeat


@dataclass(frozen=True)
class Kind:
    """What a family of problems is like: gate (px, rad), soft cost of the distance from the prior or none, share of
    arcs dropped and of clutter, pockets that repeat or arcs strewn."""

    gate: float
    turn: float
    soft: bool
    dropped: float
    clutter: float
    repeated: bool


KINDS = {
    "gated": Kind(25.0, 0.6, True, 0.15, 0.2, False),
    "open": Kind(150.0, 2.0, True, 0.15, 0.2, False),
    "hard": Kind(110.0, 0.6, False, 0.3, 0.4, True),
    "pockets": Kind(110.0, 0.6, False, 0.15, 0.2, True),
}


@dataclass(frozen=True)
class Scene:
    """problem; truth (units,): the true label of each unit, -1 for none."""

    problem: MatchingProblem
    truth: Ints


def scene(kind: str, units: int, seed: int) -> Scene:
    """A problem of one of KINDS."""
    k = KINDS[kind]
    rng = np.random.default_rng([seed, units, list(KINDS).index(kind)])
    position, angle, family = _arcs(rng, units, k)
    seen = np.flatnonzero(rng.random(len(position)) > k.dropped)
    strewn = int(k.clutter * units)
    low, high = position.min(axis=0) - 20, position.max(axis=0) + 20
    label_position = np.concatenate(
        [position[seen] + rng.normal(0, 1.0, (len(seen), 2)), rng.uniform(low, high, (strewn, 2))]
    )
    label_angle = np.concatenate([angle[seen] + rng.normal(0, 0.05, len(seen)), rng.uniform(0, np.pi, strewn)])
    label_family = np.concatenate([family[seen], rng.integers(0, 2, strewn)])
    order = rng.permutation(len(label_position))
    label_position, label_angle, label_family = label_position[order], label_angle[order], label_family[order]
    place = np.argsort(order)
    truth = np.full(units, NONE)
    truth[seen] = place[: len(seen)]

    moved = label_position[None] - position[:, None]
    turned = np.abs((angle[:, None] - label_angle[None] + np.pi / 2) % np.pi - np.pi / 2)
    distance = np.linalg.norm(moved, axis=2)
    unit, label = np.nonzero((distance < k.gate) & (turned < k.turn) & (family[:, None] == label_family[None]))
    soft = np.minimum(3, np.rint(3 * (distance[unit, label] / 90) ** 2)).astype(np.int64) if k.soft else 0 * unit

    a, b = _neighbours(position)
    degree = np.bincount(a, minlength=units)
    problem = matching_problem(
        np.maximum(1, np.ceil(0.6 * degree)).astype(np.int64),
        len(label_position),
        np.stack([unit, label, soft], axis=1),
        np.stack([a, b, np.ones(len(a), np.int64)], axis=1),
        _compatibilities(unit, label, a[a < b], b[a < b], position, label_position),
    )
    return Scene(problem, truth)


def _arcs(rng: np.random.Generator, units: int, k: Kind) -> tuple[Floats, Floats, Ints]:
    """Position, angle and family of the arcs."""
    if not k.repeated:
        position = rng.uniform(0, 90 * np.sqrt(units / 10), (units, 2))
        return position, rng.uniform(0, np.pi, units), rng.integers(0, 2, units)
    pocket, angle, family = rng.uniform(-35, 35, (POCKET, 2)), rng.uniform(0, np.pi, POCKET), rng.integers(0, 2, POCKET)
    pockets = -(-units // POCKET)
    side = int(np.ceil(np.sqrt(pockets)))
    cells = [(i % side, i // side) for i in range(pockets)]
    position = (np.array(cells)[:, None] * PITCH + pocket).reshape(-1, 2)[:units]
    return position, np.tile(angle, pockets)[:units], np.tile(family, pockets)[:units]


def _neighbours(position: Floats, count: int = 8, radius: float = 60.0) -> tuple[Ints, Ints]:
    """Ordered pairs of the nearest within a radius, made symmetric."""
    distance = np.linalg.norm(position[:, None] - position[None], axis=2)
    np.fill_diagonal(distance, np.inf)
    nearest = np.argsort(distance, axis=1, kind="stable")[:, :count]
    near = np.zeros(distance.shape, bool)
    np.put_along_axis(near, nearest, np.take_along_axis(distance, nearest, axis=1) < radius, axis=1)
    a, b = np.nonzero(near | near.T)
    return a, b


def _compatibilities(
    unit: Ints, label: Ints, a: Ints, b: Ints, position: Floats, label_position: Floats, tolerance: float = 6.0
) -> Ints:
    """Rows (u, l, v, m) of neighbours (a, b) whose labels lie to each other as they do, to within a tolerance, px."""
    rows = [np.zeros((0, 4), np.int64)]
    labels = np.split(label, np.searchsorted(unit, np.arange(1, len(position))))
    for u, v in zip(a.tolist(), b.tolist(), strict=True):
        offset = label_position[labels[v]][None] - label_position[labels[u]][:, None] - (position[v] - position[u])
        i, j = np.nonzero(np.abs(offset).max(axis=2) < tolerance)
        rows.append(np.stack([np.full(len(i), u), labels[u][i], np.full(len(i), v), labels[v][j]], axis=1))
    return np.concatenate(rows)
