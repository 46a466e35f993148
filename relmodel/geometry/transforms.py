"""Rigid transforms, vectors by components, boxes of what is placed, and trees of links and joints.

Transforms are 4x4 arrays named `a_from_b`; the twelve columns m00 .. m23 hold them in tables."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import Floats, Ints
from relmodel.errors import InputError

# The columns of a rigid transform in tables: its upper 3x4, row-major.
MATRIX_COLUMNS = tuple(f"m{row}{column}" for row in range(3) for column in range(4))


def matrix_columns(transforms: npt.ArrayLike) -> dict[str, Floats]:
    """Columns m00 .. m23 of one transform (4, 4) or of many (n, 4, 4)."""
    m = np.asarray(transforms, float).reshape(-1, 4, 4)
    return {name: m[:, int(name[1]), int(name[2])].copy() for name in MATRIX_COLUMNS}


def matrices(columns: Mapping[Any, Any]) -> Floats:
    """Transforms (n, 4, 4) from columns m00 .. m23; one (4, 4) from a row that has them."""
    out = np.zeros((*np.shape(columns[MATRIX_COLUMNS[0]]), 4, 4))
    for name in MATRIX_COLUMNS:
        out[..., int(name[1]), int(name[2])] = columns[name]
    out[..., 3, 3] = 1
    return out


def rigid(rotation: Floats, shift: npt.ArrayLike) -> Floats:
    """Transforms (..., 4, 4) of rotations (..., 3, 3) and shifts (..., 3)."""
    out = np.zeros((*rotation.shape[:-2], 4, 4))
    out[..., :3, :3], out[..., :3, 3], out[..., 3, 3] = rotation, shift, 1
    return out


def inverse(transforms: Floats) -> Floats:
    """Inverse of rigid transforms (..., 4, 4)."""
    rotation = np.swapaxes(transforms[..., :3, :3], -1, -2)
    return rigid(rotation, -np.einsum("...ij,...j->...i", rotation, transforms[..., :3, 3]))


def apply(a_from_b: Floats, points: Floats) -> Floats:
    """Points (..., 3) in frame b carried to frame a."""
    return np.asarray(points @ a_from_b[:3, :3].T + a_from_b[:3, 3])


def skew(v: npt.ArrayLike) -> Floats:
    """Cross-product matrices (..., 3, 3) of vectors (..., 3): `skew(a) @ b = a x b`."""
    v = np.asarray(v, float)
    out = np.zeros((*v.shape[:-1], 3, 3))
    out[..., 0, 1], out[..., 0, 2], out[..., 1, 2] = -v[..., 2], v[..., 1], -v[..., 0]
    return out - np.swapaxes(out, -1, -2)


def carry(a_from_b: Floats) -> Floats:
    """What takes a small right perturbation (t, r) of frame b to that (6, 6) of frame a, fixed to it."""
    out = np.zeros((6, 6))
    out[:3, :3] = out[3:, 3:] = a_from_b[:3, :3]
    out[:3, 3:] = skew(a_from_b[:3, 3]) @ a_from_b[:3, :3]
    return out


def rotation_matrix(r: npt.ArrayLike) -> Floats:
    """Rotation matrices (..., 3, 3) of rotation vectors (..., 3) in radians (Rodrigues)."""
    r = np.asarray(r, float)
    angle = np.linalg.norm(r, axis=-1)[..., None, None]
    k = skew(r)
    # np.sinc(x / pi) = sin x / x, good at zero; (1 - cos x) / x^2 = sinc^2(x / 2) / 2.
    return np.asarray(np.eye(3) + np.sinc(angle / np.pi) * k + 0.5 * np.sinc(angle / (2 * np.pi)) ** 2 * (k @ k))


def rotation_vector(rotation: Floats) -> Floats:
    """The rotation vector (3,) of a rotation matrix, radians; inverse of `rotation_matrix` for angles below pi."""
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_matrix(rotation).as_rotvec())


def nearest_rotation(matrix: Floats) -> Floats:
    """The rotation nearest to a matrix (3, 3) in the Frobenius norm (polar decomposition)."""
    u, _, vt = np.linalg.svd(matrix)
    return np.asarray(u @ np.diag([1.0, 1.0, np.linalg.det(u @ vt)]) @ vt)


def boxes_carried(a_from_b: Floats, boxes: Floats) -> Floats:
    """Axis-aligned boxes (n, 6: x0 y0 z0 x1 y1 z1) in frame b, as the axis-aligned boxes in frame a that hold them.

    `a_from_b` is one transform (4, 4) or one a box (n, 4, 4).  (Arvo, "Transforming axis-aligned bounding boxes",
    Graphics Gems 1990.)  Each bound is a sum of products in the order x, y, z, translation: rounding is monotone, so
    a box that holds another still holds it when both are carried, and SQL that sums in this order gives equal bits."""
    out = np.empty((len(boxes), 6))
    for i in range(3):
        ends = [(a_from_b[..., i, j] * boxes[:, j], a_from_b[..., i, j] * boxes[:, 3 + j]) for j in range(3)]
        for column, extreme in ((i, np.minimum), (3 + i, np.maximum)):
            x, y, z = (extreme(*pair) for pair in ends)
            out[:, column] = x + y + z + a_from_b[..., i, 3]
    return out


# Many vectors at once, stored by components (d, n), so that NumPy's inner loops run along the vectors.
#
# As vectors (n, d) such an array is its transpose, which costs nothing; arithmetic on it keeps the order.


def take(vectors: Floats, row: Ints) -> Floats:
    """Vectors `row` (n,) of some (m, d) that are the transpose of components, as components (d, n)."""
    return np.take(vectors.T, row, axis=1)


def scatter(out: npt.NDArray[np.floating[Any]], at: Ints | slice, values: Floats) -> None:
    """Set components (d, n) at some places."""
    for row, value in zip(out, values, strict=True):
        row[at] = value


def dot(a: Floats, b: Floats) -> Floats:
    """Scalar products (n,) of components (3, n)."""
    return np.asarray(a[0] * b[0] + a[1] * b[1] + a[2] * b[2])


def cross(a: Floats, b: Floats) -> Floats:
    """Vector products (3, n) of components (3, n)."""
    out = np.empty(np.broadcast_shapes(a.shape, b.shape))
    for k, (i, j) in enumerate(((1, 2), (2, 0), (0, 1))):
        np.subtract(a[i] * b[j], a[j] * b[i], out=out[k])
    return out


def unit(a: Floats) -> Floats:
    """Components (3, n) over their lengths; a vector of no length stays."""
    length = np.sqrt(dot(a, a))
    return np.asarray(a / np.where(length > 0, length, 1.0))


# Boxes of placed shapes, by the corners of their convex hulls.

_AT_ONCE = 1 << 20  # corners carried at once
_DIRECTIONS = (8, 30, 120)  # in which extreme points are looked for, by and by
_FEW = 4000  # points whose hull is quickly found
_BLOCK = 1 << 13  # points compared at once


def outermost(points: Floats) -> Floats:
    """Those of points (n, 3) that lie farthest out in some direction; of flat ones all.

    What lies within a polytope between a few of the points is none of them and is left out first (Akl and Toussaint,
    "A fast convex hull algorithm", 1978), which also leaves out what is off one of them by rounding only."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        left = points
        for count in _DIRECTIONS:
            if len(left) <= _FEW:
                break
            kept = np.zeros(len(left), bool)
            kept[(_spread(count) @ left.T).argmax(axis=1)] = True
            sides = ConvexHull(left[kept]).equations
            rounding = 4 * np.finfo(float).eps * np.abs(left).max()
            for rows in (slice(first, first + _BLOCK) for first in range(0, len(left), _BLOCK)):
                kept[rows] |= (sides[:, :3] @ left[rows].T + sides[:, 3:]).max(axis=0) > rounding
            left = left[kept]
        return np.asarray(left[ConvexHull(left).vertices], float)
    except (QhullError, ValueError):  # flat, or fewer than four
        return points


def _spread(count: int) -> Floats:
    """Directions (count + 6, 3) all around, the axes both ways first: a spiral of Fibonacci's."""
    place = np.arange(count) + 0.5
    height, turn = 1 - 2 * place / count, np.pi * (1 + np.sqrt(5)) * place
    around = np.stack([np.cos(turn), np.sin(turn)], axis=1) * np.sqrt(1 - height**2)[:, None]
    return np.concatenate([np.eye(3), -np.eye(3), np.column_stack([around, height])])


def hull_triangles(points: Floats) -> Floats:
    """Triangles (m, 3, 3) of the convex hull of points (n, 3), counter-clockwise from outside; of flat points those
    that fill it, and of points along a line, or of one, a triangle without area."""
    from scipy.spatial import ConvexHull

    middle = points.mean(axis=0)
    size, axes = np.linalg.svd(points - middle, full_matrices=False)[1:]
    rank = int((size > 1e-9 * max(1.0, size[0])).sum())
    along = (points - middle) @ axes.T
    if rank < 2:
        return np.asarray(points[[[along[:, 0].argmin(), along[:, 0].argmax(), along[:, 0].argmax()]]])
    if rank == 2:
        around = points[ConvexHull(along[:, :2]).vertices]
        return np.stack([np.broadcast_to(around[0], (len(around) - 2, 3)), around[1:-1], around[2:]], axis=1)
    hull = ConvexHull(points)
    triangles = np.asarray(points[hull.simplices], float)
    normals = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0])
    inward = np.einsum("md,md->m", normals, hull.equations[:, :3]) < 0
    triangles[inward] = triangles[inward][:, ::-1]
    return triangles


@dataclass(frozen=True)
class Hulls:
    """Hulls of shapes: of shape `shape_id[i]`, which increase, the corners `start[i]` to `start[i + 1]` (n, 3), and by
    how much at most it reaches beyond them, mm.  A shape that is not among them fills its box."""

    shape_id: Ints
    corners: Floats
    start: Ints
    beyond_mm: Floats

    @classmethod
    def of(cls, columns: Mapping[str, npt.NDArray[Any]]) -> Hulls:
        """Of the rows of the query find/hulls."""
        names = ("hull_x", "hull_y", "hull_z")
        corners = np.stack([np.concatenate([np.empty(0), *columns[name]]).astype(float) for name in names], axis=1)
        start = np.cumsum([0, *map(len, columns["hull_x"])])
        return cls(columns["shape_id"].astype(np.int64), corners, start, columns["hull_mm"].astype(float))


def boxes_placed(
    a_from_shape: Floats, boxes: Floats, shape_id: Ints, hulls: Hulls, *, turn_again: bool = False
) -> Floats:
    """The boxes (n, 6) in frame a of shapes (n,) with the boxes (n, 6) in their own frames, each placed (n, 4, 4).

    That is the box around the placed hull with what reaches beyond it, or the box of the placed box where that is less.
    turn_again: leave the latter out where there is a hull, so that the box, carried into any other frame, holds the one
    that this gives there.  Sums are in the order x, y, z, translation, so that SQL that sums in this order gives equal
    bits."""
    placed = boxes_carried(a_from_shape, boxes)
    hull = np.searchsorted(hulls.shape_id, shape_id)
    known = np.flatnonzero(np.isin(shape_id, hulls.shape_id))
    number = np.diff(hulls.start)[hull[known]]
    for rows in np.split(known, np.searchsorted(np.cumsum(number), np.arange(_AT_ONCE, number.sum(), _AT_ONCE))):
        if not len(rows):
            continue
        of, many = hull[rows], np.diff(hulls.start)[hull[rows]]
        first = np.cumsum(many) - many
        corner = np.arange(many.sum()) + np.repeat(hulls.start[of] - first, many)
        x, y, z = hulls.corners[corner].T
        for i in range(3):
            a, b, c = (np.repeat(a_from_shape[rows, i, j], many) for j in range(3))
            along, shift = a * x + b * y + c * z, a_from_shape[rows, i, 3]
            low = np.minimum.reduceat(along, first) + shift - hulls.beyond_mm[of]
            high = np.maximum.reduceat(along, first) + shift + hulls.beyond_mm[of]
            placed[rows, i] = low if turn_again else np.maximum(placed[rows, i], low)
            placed[rows, 3 + i] = high if turn_again else np.minimum(placed[rows, 3 + i], high)
    return placed


# Trees of links and joints: where the links are for given joint values, and how they move with them.
#
# A joint's frame lies in its parent link (`parent_from_joint`); the child link's frame is the joint's, turned about or
# moved along the axis by the joint's value (the convention of URDF). Angles rad, travel mm.

KINDS = ("revolute", "continuous", "prismatic", "fixed")


@dataclass(frozen=True)
class Mimic:
    """A joint whose value follows another's: factor * value + offset."""

    joint: str
    factor: float
    offset: float


@dataclass(frozen=True)
class Joint:
    """One joint; lower and upper are None where it has no limit."""

    name: str
    kind: str
    parent: str
    child: str
    axis: Floats  # (3,) unit, in the joint's frame
    lower: float | None
    upper: float | None
    parent_from_joint: Floats  # (4, 4)
    mimic: Mimic | None = None

    @property
    def limits(self) -> tuple[float, float]:
        return -np.inf if self.lower is None else self.lower, np.inf if self.upper is None else self.upper

    def motion(self, value: float) -> Floats:
        """`joint_from_child` (4, 4) at a value, rad or mm."""
        out = np.eye(4)
        if self.kind == "prismatic":
            out[:3, 3] = value * self.axis
        elif self.kind != "fixed":
            out[:3, :3] = rotation_matrix(value * self.axis)
        return out


class JointTree:
    """Links connected by joints, one root; parent joints come first.

    Raises InputError where a name stands twice or is unknown, a link has two parents, there are several roots, or
    joints close a ring."""

    def __init__(self, links: Sequence[str], joints: Sequence[Joint]) -> None:
        for what, names in (("link", list(links)), ("joint", [j.name for j in joints])):
            twice = sorted({name for name in names if names.count(name) > 1})
            if twice:
                raise InputError(f"the {what} {twice[0]!r} is defined twice: give one of them another name")
        by_child: dict[str, Joint] = {}
        for joint in joints:
            for link in (joint.parent, joint.child):
                if link not in links:
                    raise InputError(f"joint {joint.name!r} names the link {link!r}, which is not there: add the link")
            if joint.child in by_child:
                raise InputError(
                    f"link {joint.child!r} has two parent joints, {by_child[joint.child].name!r} and {joint.name!r}: "
                    "links must form a tree"
                )
            by_child[joint.child] = joint
        roots = [link for link in links if link not in by_child]
        if len(roots) > 1:
            raise InputError(
                f"the links {roots[0]!r} and {roots[1]!r} have no parent joint: join them, one link is the root"
            )
        ordered: list[Joint] = []
        reached = list(roots)
        for link in reached:  # grows: breadth first
            below = [joint for joint in joints if joint.parent == link]
            ordered += below
            reached += [joint.child for joint in below]
        self.joints = tuple(ordered)
        if len(self.joints) < len(joints) or not roots:
            ring = next(j for j in joints if j not in self.joints)
            raise InputError(f"joint {ring.name!r} belongs to a cycle of joints: links must form a tree")
        self.root = roots[0]
        self._joint = {j.name: j for j in self.joints}
        self._above = by_child
        for joint in joints:
            if joint.mimic is not None:
                leader = self._joint.get(joint.mimic.joint)
                if leader is None or leader.kind == "fixed" or leader.mimic is not None:
                    raise InputError(
                        f"joint {joint.name!r} follows {joint.mimic.joint!r}, which does not move by itself: name one "
                        "that does"
                    )

    @property
    def movable(self) -> tuple[Joint, ...]:
        """Joints that have a value of their own."""
        return tuple(j for j in self.joints if j.kind != "fixed" and j.mimic is None)

    def values(self, given: Mapping[str, float], what: str) -> dict[str, float]:
        """Values of all joints that move, rad or mm, from those given; a name with `_deg` gives an angle in degrees.

        A joint that is not given stands at zero, or at the limit next to it.  Raises InputError, beginning with
        `what`, for an unknown joint, one given twice, or a value outside the limits, of a follower too."""
        named = self.named(given, what)
        out = self.followed({j.name: named.get(j.name, float(np.clip(0.0, *j.limits))) for j in self.movable})
        for joint in self.joints:
            if joint.name in out:
                _check_limits(joint, out[joint.name], what)
        return out

    def followed(self, values: dict[str, float]) -> dict[str, float]:
        """Values of the joints that move by themselves, with those of the joints that follow them."""
        return values | {
            j.name: j.mimic.factor * values[j.mimic.joint] + j.mimic.offset for j in self.joints if j.mimic is not None
        }

    def sigmas(self, given: Mapping[str, float], what: str) -> dict[str, float]:
        """Standard deviations of the joints given, rad or mm, named as for `values`.

        Raises InputError, beginning with `what`, for an unknown joint, one given twice, or a sigma of 0 or less."""
        out = self.named(given, what)
        for name, sigma in out.items():
            if not 0 < sigma < np.inf:
                raise InputError(f"{what}: that of joint {name!r} is {sigma:g}: give one above zero")
        return out

    def named(self, given: Mapping[str, float], what: str) -> dict[str, float]:
        """Values in rad or mm by joint, of names that may end in `_deg`.  Raises InputError as `values`."""
        out: dict[str, float] = {}
        for name, number in given.items():
            joint, value = self._joint.get(name), float(number)
            if joint is None and name.endswith("_deg"):
                joint, value = self._joint.get(name.removesuffix("_deg")), float(np.radians(value))
                if joint is not None and joint.kind == "prismatic":
                    raise InputError(f"{what}: joint {joint.name!r} is prismatic: give its travel in mm, without _deg")
            if joint is None or joint not in self.movable:
                known = ", ".join(j.name for j in self.movable) or "there are none"
                why = "unknown" if joint is None else "fixed" if joint.kind == "fixed" else "a follower of another"
                raise InputError(f"{what}: joint {name!r} is {why}: name one of those that move by themselves: {known}")
            if joint.name in out:
                raise InputError(f"{what}: joint {joint.name!r} is given twice: give it once")
            out[joint.name] = value
        return out

    def poses(self, values: Mapping[str, float]) -> dict[str, Floats]:
        """`root_from_link` (4, 4) of every link at the values (of `values()`) of the joints."""
        out = {self.root: np.eye(4)}
        for joint in self.joints:
            out[joint.child] = out[joint.parent] @ joint.parent_from_joint @ joint.motion(values.get(joint.name, 0.0))
        return out

    def screws(self, link: str, values: Mapping[str, float], names: Sequence[str]) -> Floats:
        """How the link moves with the joints `names`: twists (6, n), (v mm, w rad) about the root's origin, each per
        rad or mm, in the root's frame: root_from_link' = (1 + [twist]) root_from_link.  Joints that follow count in."""
        poses = self.poses(values)
        out = np.zeros((6, len(names)))
        while link != self.root:
            joint = self._above[link]
            leader, factor = (joint.name, 1.0) if joint.mimic is None else (joint.mimic.joint, joint.mimic.factor)
            if leader in names:
                frame = poses[joint.parent] @ joint.parent_from_joint
                axis = frame[:3, :3] @ joint.axis
                if joint.kind == "prismatic":
                    twist = np.concatenate([axis, np.zeros(3)])
                else:
                    twist = np.concatenate([np.cross(frame[:3, 3], axis), axis])
                out[:, list(names).index(leader)] += factor * twist
            link = joint.parent
        return out


def _check_limits(joint: Joint, value: float, what: str) -> None:
    if not np.isfinite(value):
        raise InputError(f"{what}: joint {joint.name!r} has a value that is not finite: correct it")
    low, high = joint.limits
    if not low - 1e-9 <= value <= high + 1e-9:
        if joint.kind == "prismatic":
            said = f"{value:g} mm is outside its limits {low:g} .. {high:g} mm"
        else:
            degrees, least, most = np.degrees([value, low, high])
            said = f"{value:g} rad ({degrees:g} deg) is outside its limits {low:g} .. {high:g} rad "
            said += f"({least:g} .. {most:g} deg)"
        raise InputError(f"{what}: joint {joint.name!r} at {said}: give a value within them")
