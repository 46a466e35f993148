"""Circles and straight edges in space: those that pictures show, and those of an object, joined in pairs."""

from __future__ import annotations

from dataclasses import asdict, dataclass, field
from functools import cached_property

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bools, Floats, Ints, Rows, count_from
from relmodel.features.holes import CIRCLE_DEFAULTS as KEPT
from relmodel.features.holes import relate
from relmodel.geometry.transforms import rigid
from relmodel.store.database import Database
from vision.cameras.cameras import Camera
from vision.constellations.constellation_parameters import (
    EllipseParameters,
    JoinParameters,
    LineParameters,
    OnePictureParameters,
)
from vision.extraction.arcs import CIRCULAR, ELLIPTIC
from vision.extraction.fits import fit_ellipses
from vision.extraction.rows import Primitives
from vision.stereo.triangulate import CURVES, SpaceArcs

Relations = dict[str, Floats | Ints]
"""Columns of relations in space, a row each."""


@dataclass(frozen=True)
class Circles(Rows):
    """Circles (n,): centre (n, 3) and radius (n,) in mm, unit normal (n, 3) of either sign, and the covariance of all
    three (n, 7, 7)."""

    centre: Floats
    normal: Floats
    radius: Floats
    covariance: Floats

    @classmethod
    def exact(cls, centre: Floats, normal: Floats, radius: Floats) -> Circles:
        """Those of a model, of no covariance."""
        return cls(centre, normal, radius, np.zeros((len(radius), 7, 7)))

    def relations(self, p: JoinParameters) -> Relations:
        """How they lie to each other two by two, those that are sure enough to be joined: columns of the relation that
        `queries/constellations/join.sql` takes."""
        a, b = np.triu_indices(len(self), 1)
        found = relate(self.centre, self.normal, self.radius, a, b)
        found |= {f"{name}_sigma": values for name, values in self._sigmas(a, b).items()}
        rows = (found["distance"] >= KEPT.least_distance) & (found["distance"] <= KEPT.greatest_distance)
        rows &= (found["distance_sigma"] <= p.most_sigma_mm) & (found["normals_sigma"] <= p.most_sigma_cosine)
        return {"unit_a": a[rows], "unit_b": b[rows]} | {name: values[rows] for name, values in found.items()}

    def _sigmas(self, a: Ints, b: Ints) -> dict[str, Floats]:
        """Standard deviations (k,) of the relations of circles a (k,) with b (k,), to the second order where an angle
        is near to none and its cosine moves no more with it."""
        line = self.centre[b] - self.centre[a]
        distance = np.linalg.norm(line, axis=1, keepdims=True)
        line = line / np.maximum(distance, 1e-12)
        one, other = self.covariance[a], self.covariance[b]

        def spread(of_a: Floats, of_b: Floats) -> Floats:
            """Variances of what changes with centre and normal of both by these (k, 6)."""
            first, second = (
                np.einsum("ki,kij,kj->k", by, covariance[:, :6, :6], by)
                for by, covariance in ((of_a, one), (of_b, other))
            )
            return np.asarray(first + second)

        still = np.zeros_like(line)
        lean = [np.trace(c[:, 3:6, 3:6], axis1=1, axis2=2) / 2 for c in (one, other)]
        shift = [np.trace(c[:, :3, :3], axis1=1, axis2=2) / 3 for c in (one, other)]
        turn = sum(shift) / distance[:, 0] ** 2
        out = {
            "radius_a": np.sqrt(one[:, 6, 6]),
            "radius_b": np.sqrt(other[:, 6, 6]),
            "distance": np.sqrt(spread(np.hstack([-line, still]), np.hstack([line, still]))),
            "normals": np.sqrt(
                spread(np.hstack([still, self.normal[b]]), np.hstack([still, self.normal[a]])) + 2 * sum(lean) ** 2
            ),
        }
        for name, normal, way in (("rise_a", self.normal[a], 0), ("rise_b", self.normal[b], 1)):
            across = (normal - np.einsum("ki,ki->k", normal, line)[:, None] * line) / distance
            parts = [np.hstack([-across, still]), np.hstack([across, still])]
            parts[way][:, 3:] = line
            out[name] = np.sqrt(spread(*parts) + 2 * (lean[way] + turn) ** 2)
        return out


@dataclass(frozen=True)
class JoinedPairs:
    """Pairs (k, 2) of the scene's circles or lines with the pairs (k, 2) of the model's that they are like, the rarest
    first; alike (k,): how many pairs of the model the pair of the scene is like; sign (k, 2): -1 where a line of the
    scene runs against the model's, of circles none."""

    scene: Ints
    model: Ints
    alike: Ints
    sign: Ints = field(default_factory=lambda: np.zeros((0, 2), np.int64))


def read_joined(rows: Relations, of: str) -> JoinedPairs:
    """The pairs of the rows of a join, in which those `of` the model are called so."""
    scene, model, *sign = (
        np.stack([rows[f"{name}_a"], rows[f"{name}_b"]], axis=1).astype(np.int64)
        for name in ("unit", of, "sign")
        if f"{name}_a" in rows
    )
    return JoinedPairs(scene, model, rows["alike"].astype(np.int64), *sign)


def read_circles(store: Database, connection: Connection, object_id: int) -> Circles:
    """The circles of an object in its frame, in the order of their numbers."""
    found = store.select(connection, "circle", order="circle_no", object_id=object_id)
    centre, normal = (np.stack([found[n] for n in names], axis=1) for names in (("x", "y", "z"), ("nx", "ny", "nz")))
    return Circles.exact(centre, normal, found["radius"])


def find_scene_circles(space: SpaceArcs) -> tuple[Ints, Circles]:
    """Circles among matched arcs, in the rig's frame, that are of a size to be related, and which arcs (n,) they are;
    an ellipse counts as the circle on its major axis."""
    size = np.linalg.norm(space.conics.major, axis=1)
    normal = np.cross(space.conics.major, space.conics.minor)
    length = np.linalg.norm(normal, axis=1)
    rows = np.flatnonzero((length > 0) & (size >= KEPT.least_radius) & (size <= KEPT.greatest_radius))
    normal = normal[rows] / length[rows, None]
    return rows, Circles(space.conics.centre[rows], normal, size[rows], space.conics.covariance[rows])


# The circles in space that an ellipse of one picture may be: for each radius two.


@dataclass(frozen=True)
class PictureEllipses(Rows):
    """Ellipses (n,) in the pixels of a camera without distortion, the surest first.

    centre (n, 2), major, minor (n,): semi-axes, angle (n,): of the major axis from x towards y, rad; seen (n,): the
    share of the way round that its arc runs; size_share (n,): standard deviation of the size, as a share of it; tilt
    (n,): that of the angle at which the circle is seen, rad."""

    centre: Floats
    major: Floats
    minor: Floats
    angle: Floats
    seen: Floats
    size_share: Floats
    tilt: Floats

    @property
    def conics(self) -> Floats:
        """Matrices (n, 3, 3) C with (x, y, 1) C (x, y, 1)' = 0 along the ellipses and < 0 inside."""
        axis = np.stack([np.cos(self.angle), np.sin(self.angle)], axis=1)
        across = np.stack([-axis[:, 1], axis[:, 0]], axis=1)
        axis, across = axis / self.major[:, None], across / self.minor[:, None]
        out = np.empty((len(self), 3, 3))
        out[:, :2, :2] = axis[:, :, None] * axis[:, None] + across[:, :, None] * across[:, None]
        level = np.einsum("nij,nj->ni", out[:, :2, :2], self.centre)
        out[:, :2, 2] = out[:, 2, :2] = -level
        out[:, 2, 2] = np.einsum("ni,ni->n", level, self.centre) - 1
        return out


def find_ellipses(picture: Primitives, camera: Camera, p: EllipseParameters) -> PictureEllipses:
    """The ellipses that a picture's arcs run along, refitted without the camera's distortion; of arcs along one
    rim the longest.  Arcs that show too little of an ellipse to say its size are left out."""
    arcs = picture.arcs
    round_ = np.flatnonzero(np.isin(arcs.kind, (CIRCULAR, ELLIPTIC)) & (np.diff(arcs.offsets) >= p.least_elements))
    counts = np.diff(arcs.offsets)[round_]
    _, element = count_from(arcs.offsets[round_], counts)
    place = camera.undistort(np.column_stack([picture.elements.x, picture.elements.y])[element])
    fitted = fit_ellipses(place[:, 0], place[:, 1], np.ones(len(place)), counts)
    around = 2 * np.pi * np.sqrt(0.5 * (fitted.major**2 + fitted.minor**2))
    seen = np.minimum(arcs.length[round_] / around, 1.0)
    size = p.size_px + np.where(seen < p.well_seen, p.short_px, 0.0) + np.sqrt(fitted.square)
    # The ratio of the axes is the cosine at which the circle is seen: at a right angle it says least.
    ratio, off = fitted.minor / fitted.major, 2 * size / fitted.major
    tilt = np.arccos(np.maximum(ratio - off, 0.0)) - np.arccos(np.minimum(ratio + off, 1.0))
    columns = (fitted.major, fitted.minor, fitted.angle, seen, size / fitted.major, np.clip(tilt / 2, *p.tilt))
    found = PictureEllipses(np.column_stack([fitted.centre_x, fitted.centre_y]), *columns)
    with np.errstate(invalid="ignore"):
        use = (found.seen >= p.least_seen) & (found.minor >= p.least_px) & (fitted.square <= p.residual_px**2)
    order = np.argsort(-np.where(use, found.seen * found.major, 0.0), kind="stable")[: use.sum()]
    return found.take(order[_distinct(found.take(order), p)][: p.most])


def _distinct(e: PictureEllipses, p: EllipseParameters) -> Bools:
    """Those (n,) that none before them is like."""
    apart = np.linalg.norm(e.centre[:, None] - e.centre, axis=2)
    like = (apart < p.same_px) & (np.abs(e.major[:, None] - e.major) < p.same_px + p.same_share * e.major)
    return np.asarray(~np.triu(like, 1).any(axis=0))


def find_circles(ellipses: PictureEllipses, camera: Camera) -> tuple[Floats, Floats]:
    """Centres and unit normals (n, 2, 3), in the camera's frame, of the circles of radius 1 mm that are seen as each of
    the ellipses; of another radius the centre is so many times as far off.  Normals point to the camera.

    The cone through the ellipse has, in the frame of its eigenvectors, l1 x^2 + l2 y^2 + l3 z^2 = 0 with l1 >= l2 > 0
    > l3.  Planes that cut it in circles have the normals (+-sqrt(l1 - l2), 0, sqrt(l2 - l3)) / sqrt(l1 - l3)
    (Safaee-Rad, Tchoukanov, Smith and Benhabib, "Three-dimensional location estimation of circular features for
    machine vision", IEEE Trans. Robotics and Automation 8(5), 1992).  The centre c is the pole of its plane, Q c ~ n;
    its length follows from c' Q c = -r^2 l2, as Q is l2 on directions in the plane."""
    cone = camera.matrix.T @ ellipses.conics @ camera.matrix
    value, vector = np.linalg.eigh(cone)
    l3, l2, l1 = value.T
    across, along = np.sqrt(np.maximum(l1 - l2, 0.0) / (l1 - l3)), np.sqrt((l2 - l3) / (l1 - l3))
    normal = np.stack(
        [sign * across[:, None] * vector[:, :, 2] + along[:, None] * vector[:, :, 0] for sign in (1.0, -1.0)], axis=1
    )
    pole = np.einsum("nij,nj,nkj,nwk->nwi", vector, 1 / value, vector, normal)
    length = np.sqrt(-l2[:, None] / np.einsum("nwi,nwi->nw", normal, pole))
    centre = pole * (length * np.sign(pole[:, :, 2]))[..., None]
    return centre, -np.sign(np.einsum("nwi,nwi->nw", normal, centre))[..., None] * normal


# Poses of one camera fitted to the ellipses of its picture, and scored by how many of them they explain.


@dataclass(frozen=True)
class EllipseFit:
    """Fits and scores poses (k, 12), camera from model, on the ellipses of a picture: see `ellipse_kernels`."""

    ellipses: PictureEllipses
    camera: Camera
    model: Circles
    p: OnePictureParameters

    def fit_pairs(self, poses: Floats, circle: Ints, ellipse: Ints) -> Floats:
        """Poses fitted to two circles and ellipses (k, 2) each, those (n, 12) at which these are seen so."""
        poses, off = self.fit(poses, circle, ellipse)
        e, p = self.ellipses, self.p
        limit = p.fit_px + p.fit_share * e.major + np.where(e.seen < p.well_seen, p.fit_short_px, 0.0)
        return np.asarray(poses[off <= limit[ellipse].max(axis=1)])

    def fit(self, poses: Floats, circle: Ints, ellipse: Ints) -> tuple[Floats, Floats]:
        """Poses led to where circles are seen as ellipses (k, m), and how far off (k,) px these then are."""
        from vision.constellations import ellipse_kernels

        poses, off = poses.copy(), np.empty(len(poses))
        ellipse_kernels.fit(
            self._points, np.ascontiguousarray(circle), self.ellipses.conics, np.ascontiguousarray(ellipse),
            self._matrix, self.p.rounds, self.p.robust_px, np.empty((6, 6)), np.empty(6), np.empty(15), poses, off,
        )  # fmt: skip
        return poses, off

    def score(self, poses: Floats) -> tuple[Floats, Ints]:
        """The log odds (k,) of the ellipses that poses explain against chance, and by which circle (k, e), -1: none."""
        from vision.constellations import ellipse_kernels

        p, e, camera = self.p, self.ellipses, self.camera
        like, which = np.empty((len(poses), len(e))), np.empty((len(poses), len(e)), np.int64)
        inside = np.empty(len(poses), np.int64)
        ellipse_kernels.explain(
            np.ascontiguousarray(self.model.centre), np.ascontiguousarray(self.model.normal),
            np.column_stack([e.centre, e.major, e.minor / e.major]), self._matrix,
            np.array([camera.width, camera.height], float), self.model.radius,
            np.array([p.place_px, p.place_share, p.size_share, p.ratio, p.least_cosine]), poses, like, which, inside,
        )  # fmt: skip
        gate = np.pi * (2 * (p.place_px + p.place_share * e.major)) ** 2 / (camera.width * camera.height)
        by_chance = np.clip(p.chance * inside[:, None] * gate, 1e-4, 0.9)
        return np.asarray(-(like * np.log(by_chance)).sum(axis=1)), np.where(like > p.least_like, which, -1)

    @cached_property
    def _matrix(self) -> Floats:
        return np.ascontiguousarray(self.camera.matrix)

    @cached_property
    def _points(self) -> Floats:
        """Points (c, n, 3) around the model's circles."""
        normal = self.model.normal
        across = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal), axis=1)])
        across /= np.linalg.norm(across, axis=1, keepdims=True)
        axes = np.stack([across, np.cross(normal, across)], axis=1) * self.model.radius[:, None, None]
        turn = np.arange(self.p.points) * (2 * np.pi / self.p.points)
        way = np.column_stack([np.cos(turn), np.sin(turn)])
        return np.ascontiguousarray(self.model.centre[:, None] + np.einsum("ta,cai->cti", way, axes))


def to_rows(poses: Floats) -> Floats:
    """Poses (k, 4, 4) inverted, as rows (k, 12) of a rotation and a translation."""
    turned = poses[:, :3, :3].transpose(0, 2, 1)
    return np.ascontiguousarray(np.hstack([turned.reshape(-1, 9), -np.einsum("kij,kj->ki", turned, poses[:, :3, 3])]))


def to_matrices(rows: Floats) -> Floats:
    """Poses (k, 4, 4) of rows; undoes `to_rows`."""
    out = np.tile(np.eye(4), (len(rows), 1, 1))
    out[:, :3, :3] = rows[:, :9].reshape(-1, 3, 3).transpose(0, 2, 1)
    out[:, :3, 3] = -np.einsum("kij,kj->ki", out[:, :3, :3], rows[:, 9:])
    return out


# Straight edges in space, by stereo and of an object, joined in pairs: how a body without circles is found.
#
# Where an edge seems to end depends on how its arc was cut. So a pair of lines that are not parallel is described by
# what a cut does not change: their angle, their distance, and the stretch of each on which an edge was seen, from the
# foot of the common perpendicular. An edge of the body has to contain that stretch.


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


def find_scene_lines(space: SpaceArcs, p: LineParameters) -> tuple[Ints, Lines]:
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
) -> JoinedPairs:
    """Join `relate_lines` of lines in space with those of an object: `queries/constellations/join_lines.sql`."""
    with (
        store.relation(connection, "scene_pair", _lay_every_way(relations, p)),
        store.relation(connection, "model_pair", _describe(_pair(model, *np.triu_indices(len(model), 1), p), model)),
    ):
        joined = store.columns(connection, "constellations/join_lines", **asdict(p))
    return read_joined(joined, "line")


def solve_line_poses(scene: Lines, model: Lines, joined: JoinedPairs) -> Floats:
    """Poses (k, 4, 4), model from scene, of joined pairs: the directions fall together, and the feet of the common
    perpendiculars in their middle."""
    seen, stored = (_pair_all(lines, *rows.T) for lines, rows in ((scene, joined.scene), (model, joined.model)))
    sign = joined.sign.astype(float)
    here = _frames(sign[:, :1] * seen.along_a, (sign[:, 1] * seen.turned)[:, None] * seen.along_b)
    rotation = _frames(stored.along_a, stored.along_b) @ here.transpose(0, 2, 1)
    middle = 0.5 * (seen.foot_a + seen.foot_b)
    return rigid(rotation, 0.5 * (stored.foot_a + stored.foot_b) - np.einsum("kij,kj->ki", rotation, middle))


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
    orders, with both lines turned and, where about perpendicular, one; and how far angle and distance may be off."""
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
