"""Straight edges in space, by stereo and of an object, joined in pairs: how a body without circles is found.

Where an edge seems to end depends on how its arc was cut.  So a pair of lines that are not parallel is described by
what a cut does not change: their angle, their distance, and the stretch of each on which an edge was seen, from the
foot of the common perpendicular.  An edge of the body has to contain that stretch."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.columns import Rows
from relmodel.store.database import Database
from vision.constellations.circles import Relations
from vision.constellations.constellation_parameters import LineParameters
from vision.stereo.triangulate import CURVES, Triangulated


@dataclass(frozen=True)
class Lines(Rows):
    """Straight edges (n,): start and end (n, 3) mm, and the covariance (n, 6, 6) of both, mm^2."""

    start: Floats
    end: Floats
    covariance: Floats

    @property
    def length(self) -> Floats:
        """Lengths (n,), mm."""
        return np.asarray(np.linalg.norm(self.end - self.start, axis=1))


@dataclass(frozen=True)
class JoinedLines:
    """Pairs (k, 2) of the scene's lines with the pairs (k, 2) of the model's that they are like, the rarest first;
    sign (k, 2): -1 where a line of the scene runs against the model's; alike (k,): how many pairs of the model the pair
    of the scene is like."""

    scene: Ints
    sign: Ints
    model: Ints
    alike: Ints


@dataclass(frozen=True)
class _Pairs:
    """Pairs (k,) of lines a and b, the latter turned by `turned` (k,) to within 90 degrees of the former: unit
    directions (k, 3), feet of the common perpendicular (k, 3) and where they lie along each line, mm from its start."""

    a: Ints
    b: Ints
    turned: Floats
    along_a: Floats
    along_b: Floats
    foot_a: Floats
    foot_b: Floats
    at_a: Floats
    at_b: Floats

    @property
    def cosine(self) -> Floats:
        return np.asarray(np.einsum("ij,ij->i", self.along_a, self.along_b))

    @property
    def across(self) -> Floats:
        """Unit directions (k, 3) across both lines."""
        normal = np.cross(self.along_a, self.along_b)
        return np.asarray(normal / np.linalg.norm(normal, axis=1, keepdims=True))

    @property
    def distance(self) -> Floats:
        """From a to b along `across`: its sign tells a pair from its mirror image."""
        return np.asarray(np.einsum("ij,ij->i", self.foot_b - self.foot_a, self.across))


def find_scene_lines(space: Triangulated, p: LineParameters) -> tuple[Ints, Lines]:
    """The longest straight ones among matched arcs, in the rig's frame, and which arcs (n,) they are."""
    lines = Lines(space.start, space.end, space.covariance)
    length = np.where(space.curve == CURVES.index("line"), lines.length, 0.0)
    rows = np.argsort(-length, kind="stable")[: p.most_seen]
    rows = np.sort(rows[length[rows] >= p.least_length])
    return rows, lines.take(rows)


def relate_lines(lines: Lines, p: LineParameters) -> Relations:
    """How lines in space lie to each other two by two, those not parallel and sure enough to be joined: unit_a and
    unit_b, cosine and distance (mm) with their standard deviations, and on which stretches (mm) they were seen, from
    the foot of the common perpendicular."""
    pairs = _pair(lines, *np.triu_indices(len(lines), 1), p)
    found = _describe(pairs, lines)
    found["distance_sigma"], found["cosine_sigma"] = _sigmas(pairs, lines)
    found["sign_a"], found["sign_b"] = np.ones(len(pairs.a), np.int64), pairs.turned.astype(np.int64)
    sure = (found["distance_sigma"] <= p.most_sigma_mm) & (found["cosine_sigma"] <= p.most_sigma_cosine)
    return {name: values[sure] for name, values in found.items()}


def read_lines(store: Database, connection: Connection, object_id: int, p: LineParameters) -> Lines:
    """The longest straight edges of an object, in its frame."""
    found = store.columns(
        connection, "constellations/lines", object_id=object_id, least_length=p.least_length, most=p.most_of_object
    )
    start, end = (np.stack([found[f"{n}_{axis}"] for axis in "xyz"], axis=1) for n in ("start", "end"))
    return Lines(start, end, np.zeros((len(start), 6, 6)))


def join_lines(
    store: Database, connection: Connection, relations: Relations, model: Lines, p: LineParameters
) -> JoinedLines:
    """Join `relate_lines` of lines in space with those of an object: `queries/constellations/join_lines.sql`."""
    with (
        store.relation(connection, "scene_pair", _lay_every_way(relations, p)),
        store.relation(connection, "model_pair", _describe(_pair(model, *np.triu_indices(len(model), 1), p), model)),
    ):
        names = ("bin_mm", "along_mm", "most_of_relation", "most")
        joined = store.columns(connection, "constellations/join_lines", **{name: getattr(p, name) for name in names})
    units, signs, lines = (
        np.stack([joined[f"{n}_a"], joined[f"{n}_b"]], axis=1).astype(np.int64) for n in ("unit", "sign", "line")
    )
    return JoinedLines(units, signs, lines, joined["alike"].astype(np.int64))


def solve_line_poses(scene: Lines, model: Lines, joined: JoinedLines) -> Floats:
    """Poses (k, 4, 4), model from scene, of joined pairs: the directions fall together, and the feet of the common
    perpendiculars in their middle."""
    seen, stored = (_pair_all(lines, *rows.T) for lines, rows in ((scene, joined.scene), (model, joined.model)))
    sign = joined.sign.astype(float)
    here = _frames(sign[:, :1] * seen.along_a, (sign[:, 1] * seen.turned)[:, None] * seen.along_b)
    rotation = _frames(stored.along_a, stored.along_b) @ here.transpose(0, 2, 1)
    out = np.zeros((len(sign), 4, 4))
    out[:, 3, 3] = 1
    out[:, :3, :3] = rotation
    middle = 0.5 * (seen.foot_a + seen.foot_b)
    out[:, :3, 3] = 0.5 * (stored.foot_a + stored.foot_b) - np.einsum("kij,kj->ki", rotation, middle)
    return out


def _pair(lines: Lines, a: Ints, b: Ints, p: LineParameters) -> _Pairs:
    """Pairs of lines that are far from parallel."""
    direction = (lines.end - lines.start) / lines.length[:, None]
    crossed = np.abs(np.einsum("ij,ij->i", direction[a], direction[b])) <= p.greatest_cosine
    return _pair_all(lines, a[crossed], b[crossed])


def _pair_all(lines: Lines, a: Ints, b: Ints) -> _Pairs:
    direction = (lines.end - lines.start) / lines.length[:, None]
    along_a, along_b = direction[a], direction[b]
    turned = np.where(np.einsum("ij,ij->i", along_a, along_b) < 0, -1.0, 1.0)
    along_b = turned[:, None] * along_b
    between = lines.start[b] - lines.start[a]
    cosine, of_a, of_b = (
        np.einsum("ij,ij->i", *v) for v in ((along_a, along_b), (between, along_a), (between, along_b))
    )
    at_a, at_b = (of_a - cosine * of_b) / (1 - cosine**2), (cosine * of_a - of_b) / (1 - cosine**2)
    foot_a, foot_b = lines.start[a] + at_a[:, None] * along_a, lines.start[b] + at_b[:, None] * along_b
    return _Pairs(a, b, turned, along_a, along_b, foot_a, foot_b, at_a, at_b)


def _describe(pairs: _Pairs, lines: Lines) -> Relations:
    """Relations of pairs of lines as columns: stretches are from the foot, along the first and the turned second."""
    length_b = pairs.turned * lines.length[pairs.b]
    return {
        "unit_a": pairs.a,
        "unit_b": pairs.b,
        "cosine": pairs.cosine,
        "distance": pairs.distance,
        "low_a": -pairs.at_a,
        "high_a": lines.length[pairs.a] - pairs.at_a,
        "low_b": np.minimum(length_b, 0) - pairs.at_b,
        "high_b": np.maximum(length_b, 0) - pairs.at_b,
    }


def _lay_every_way(relations: Relations, p: LineParameters) -> Relations:
    """Relations of lines in space in every way that the directions, which an edge does not have, may be laid: in both
    orders, with both lines turned and, where they are about perpendicular, with one; and by how much angle and distance
    may be off."""
    found = dict(relations)
    found["distance_off"] = np.clip(p.sigmas * found["distance_sigma"], p.least_mm, p.bin_mm)
    found["cosine_off"] = np.clip(p.sigmas * found["cosine_sigma"], p.least_cosine, p.most_cosine)
    # The second line's direction is the one that was turned towards the first's: so it is from either side.
    swapped = found | {
        name: found[name[:-1] + "ba"["ab".index(name[-1])]] for name in found if name[-2:] in ("_a", "_b")
    }
    found = {name: np.concatenate([values, swapped[name]]) for name, values in found.items()}
    square = found["cosine"] <= found["cosine_off"]
    turned = {name: values[square] for name, values in found.items()}
    turned |= {name: -turned[name] for name in ("cosine", "distance", "sign_b")}
    turned |= {"low_b": -turned["high_b"], "high_b": -turned["low_b"]}
    found = {name: np.concatenate([values, turned[name]]) for name, values in found.items()}
    both = found | {f"sign_{n}": -found[f"sign_{n}"] for n in "ab"}
    both |= {f"{low}_{n}": -found[f"{high}_{n}"] for n in "ab" for low, high in (("low", "high"), ("high", "low"))}
    return {name: np.concatenate([values, both[name]]) for name, values in found.items()}


def _sigmas(pairs: _Pairs, lines: Lines) -> tuple[Floats, Floats]:
    """Standard deviations (k,) of distance, mm, and cosine, by the covariance of the ends."""
    of_distance, of_cosine = np.zeros(len(pairs.a)), np.zeros(len(pairs.a))
    for line, at, turned, other in (
        (pairs.a, pairs.at_a, 1.0, pairs.along_b),
        (pairs.b, pairs.at_b, pairs.turned, pairs.along_a),
    ):
        length, covariance = lines.length[line], lines.covariance[line]
        share = (turned * at / length)[:, None]
        lift = np.hstack([(1 - share) * pairs.across, share * pairs.across])
        of_distance += np.einsum("ki,kij,kj->k", lift, covariance, lift)
        turn = np.hstack([-other, other]) / length[:, None]
        of_cosine += np.einsum("ki,kij,kj->k", turn, covariance, turn)
    return np.sqrt(of_distance), np.sqrt(of_cosine)


def _frames(first: Floats, second: Floats) -> Floats:
    """Axes (k, 3, 3), as columns: across both directions, midway between them, and across these."""
    across = np.cross(first, second)
    across /= np.linalg.norm(across, axis=1, keepdims=True)
    midway = first + second
    midway /= np.linalg.norm(midway, axis=1, keepdims=True)
    return np.stack([across, midway, np.cross(across, midway)], axis=2)
