"""Triangles brought nearer to their surfaces: sides that leave them are flipped, then halved, until none does.

Of the two diagonals of two triangles that one stands which, by the curvature of the surface, keeps nearer to it (Dyn,
Levin and Rippa 1990: data dependent triangulations), so that on ruled surfaces sides come to lie along the rulings;
sides that still leave the surface are cut at their middle in (u, v).  Sides on the boundary of a face stay as they are.
All faces are worked on at once.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.geometry.components import cross, dot, picked
from relmodel.geometry.surfaces import ANALYTIC_KINDS, Surfaces
from relmodel.loading.facets.chords import beside
from relmodel.loading.facets.net import Net

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

_SHARE = 0.7  # of the chord's error for a side: amid a triangle it may be a third more than at its sides
_FLIPS, _HALVINGS = 600, 14
_FLIPPED = 6  # rounds of halving with flips before each: later ones could undo what halving does
_LONG = 0.7  # what a side must be off by, in parts of what is allowed, to be looked at for a flip
_BETTER = 0.999
_THIN = 1e-9  # share of two triangles' area that each must have after a flip
_FLAT = 1e-12  # share of the domain's area that it must have
_FOLDED, _LESS_FOLDED = 0.7, 0.05  # cosine between a triangle and the surface, and what a flip must add to it
_UNFOLDINGS = 30
_TURNED = -0.2  # beside a pole a triangle may stand upright on the surface
_HIGH = 0.5  # of the chord: what is less high is a fold of no account
_NO_AREA = 1e-9  # mm2
_MIDDLE = 0.5
_PLACES = (_MIDDLE, 0.25, 0.75)  # of a side; those besides the middle where the surface may be wavy
_GRID = 7  # samples of a free-form surface along u and along v for its curvature


@dataclass
class Triangulation:
    """points, outward normals (n, 3), uv (n, 2), face (n,) of vertices; corners (m, 3), counter-clockwise in (u, v)."""

    points: Array
    normals: Array
    uv: Array
    face: Index
    corners: Index


class Fit:
    """How far sides of triangles leave their surfaces, in parts of what is allowed."""

    def __init__(self, surfaces: Surfaces, chord_mm: float, chord_rad: float) -> None:
        self.surfaces, self.chord_mm = surfaces, chord_mm
        # The angle between a chord and the surface is half of the turn of its normal.
        self.allowed_mm, self.allowed_rad = _SHARE * chord_mm, 2 * chord_rad
        self._one_look = np.isin(surfaces.kind.astype(str), ANALYTIC_KINDS)
        self._bends: dict[int, tuple[float, float, float]] = {}  # of free-form surfaces

    def off(self, made: Triangulation, a: Index, b: Index) -> Array:
        """Of the sides from vertices a to b (n,): 1 is as much as is allowed, and what is more may be more still."""
        far = _lengths(picked(made.points, a) - picked(made.points, b)) > self.chord_mm
        turn = 2 * np.arcsin(np.clip(_lengths(picked(made.normals, a) - picked(made.normals, b)) / 2, 0, 1))
        worst = np.where(far, turn / self.allowed_rad, 0.0)
        for place in _PLACES:
            look = worst <= 1.0
            if place != _MIDDLE:
                look &= ~self._one_look[made.face[a]]
            at = np.flatnonzero(look)
            worst[at] = np.maximum(worst[at], self.off_at(made, a[at], b[at], place))
        return worst

    def off_at(self, made: Triangulation, a: Index, b: Index, place: float) -> Array:
        """Distances (n,) of the surface from sides at one place of them, in parts of what is allowed.

        Along its normal: the point of the surface is that of the place in (u, v), and may be another one of the side.
        """
        u, v = ((1 - place) * picked(made.uv, a) + place * picked(made.uv, b)).T
        on = self.surfaces.evaluate(made.face[a], u, v)
        arm, normal = beside(picked(made.points, a), picked(made.points, b), on.points).T, cross(on.by_u.T, on.by_v.T)
        length = np.sqrt(dot(normal, normal))
        sound = length > 0
        off = np.where(sound, np.abs(dot(arm, normal)) / np.where(sound, length, 1.0), np.sqrt(dot(arm, arm)))
        return np.asarray(off / self.allowed_mm)

    def bends(self, face: Index, uv: Array) -> Array:
        """How much surfaces bend away from their tangent planes: |N . S| for S_uu, S_uv, S_vv, mm (n, 3)."""
        surfaces, out = self.surfaces, np.zeros((len(face), 3))
        for kind, at in surfaces.by_kind.of(face):
            row, v = face[at], uv[at, 1]
            radius, tube = np.abs(surfaces.radius[row]), surfaces.radius2[row]
            if kind == "cylinder":
                out[at, 0] = radius
            elif kind == "cone":
                angle = surfaces.semi_angle[row]
                out[at, 0] = np.abs(surfaces.radius[row] + v * np.sin(angle)) * np.cos(angle)
            elif kind == "sphere":
                out[at, 0], out[at, 2] = radius * np.cos(v) ** 2, radius
            elif kind == "torus":
                out[at, 0], out[at, 2] = np.abs((radius + tube * np.cos(v)) * np.cos(v)), tube
            elif kind != "plane":
                faces, number = np.unique(row, return_inverse=True)
                for one in faces.tolist():
                    if one not in self._bends:
                        self._bends[one] = self._measured(one)
                out[at] = np.array([self._bends[one] for one in faces.tolist()])[number]
        return out

    def _measured(self, face: int) -> tuple[float, float, float]:
        """Means over a free-form surface, by differences."""
        u0, u1, v0, v1 = self.surfaces.domain[face]
        h, k = (u1 - u0) / (_GRID - 1), (v1 - v0) / (_GRID - 1)
        u, v = np.meshgrid(np.linspace(u0, u1, _GRID), np.linspace(v0, v1, _GRID), indexing="ij")
        at = self.surfaces.evaluate(np.full(u.size, face), u.ravel(), v.ravel())
        by_u, by_v = (x.reshape(_GRID, _GRID, 3) for x in (at.by_u, at.by_v))
        normal = np.cross(by_u, by_v)
        length = np.linalg.norm(normal, axis=2, keepdims=True)
        normal /= np.where(length > 0, length, 1.0)
        pairs = ((by_u, 0, h), (by_u, 1, k), (by_v, 1, k))
        out = []
        for by, axis, step in pairs:
            first = normal[:-1] if axis == 0 else normal[:, :-1]
            out.append(float(np.abs(np.einsum("nmd,nmd->nm", np.diff(by, axis=axis), first)).mean() / step))
        return out[0], out[1], out[2]


def refined(made: Triangulation, fit: Fit, flips: bool = True) -> tuple[Triangulation, Bools]:
    """Triangles whose sides keep to their surfaces, and the faces (n,) where that was not reached.

    Sides on the boundaries of faces are the same as before.  flips: whether diagonals are to be chosen anew.
    """
    failed = np.zeros(len(fit.surfaces), bool)
    if not len(made.corners):
        return made, failed
    done: list[Index] = []
    for turn in range(_HALVINGS):
        net = _flipped(made, fit) if flips and turn < _FLIPPED else Net(made.corners, made.uv)
        made.corners = net.corners.reshape(-1, 3)
        side = net.inner()
        wide = side[fit.off(made, *net.ends(side)) > 1.0]
        busy = np.zeros(len(fit.surfaces), bool)
        busy[made.face[made.corners[wide // 3, 0]]] = True
        active = busy[made.face[made.corners[:, 0]]]
        done.append(picked(made.corners, ~active))
        if not len(wide):
            made.corners = made.corners[:0]
            break
        middle = np.full(len(net.mate), -1)
        middle[wide] = middle[net.mate[wide]] = len(made.face) + np.arange(len(wide))
        _add_middles(made, *net.ends(wide), fit)
        made.corners = _halved(picked(made.corners, active), picked(middle.reshape(-1, 3), active))
    failed[made.face[made.corners[:, 0]]] = True  # still at work
    made.corners = np.concatenate([*done, made.corners])
    return made, failed | _unfolded(made, fit)


def folded(made: Triangulation, corners: Index, fit: Fit) -> Bools:
    """Faces (n,) with some of the triangles (m, 3) that do not face as their surface does."""
    hand = np.where(fit.surfaces.reversed, -1.0, 1.0)
    out = np.zeros(len(fit.surfaces), bool)
    out[made.face[corners[_facing(made, hand, *corners.T) < _FOLDED, 0]]] = True
    return out


def _unfolded(made: Triangulation, fit: Fit) -> Bools:
    """Flip, in place, sides of triangles that do not face as their surface does; the faces (n,) where some are left.

    There are such beside a boundary that bends one way in space and the other way in (u, v).
    """
    hand = np.where(fit.surfaces.reversed, -1.0, 1.0)
    facing = _facing(made, hand, *made.corners.T)
    busy = np.zeros(len(fit.surfaces), bool)
    busy[made.face[made.corners[facing < _FOLDED, 0]]] = True
    active = busy[made.face[made.corners[:, 0]]]
    if not active.any():
        return busy
    net = Net(made.corners[active], made.uv)
    for _ in range(_UNFOLDINGS):
        corners = net.corners.reshape(-1, 3)
        facing = _facing(made, hand, *corners.T)
        side = net.inner()
        before = np.minimum(facing[side // 3], facing[net.mate[side] // 3])
        side, before = side[before < _FOLDED], before[before < _FOLDED]
        (a, b), (c, d) = net.ends(side), net.other_ends(side)
        after = np.minimum(_facing(made, hand, c, a, d), _facing(made, hand, d, b, c))
        better = (after > before + _LESS_FOLDED) & (net.areas_after(side).min(axis=0) > 0)
        if not better.any():
            break
        net.flip(side[better], (after - before)[better])
    corners = net.corners.reshape(-1, 3)
    made.corners = np.concatenate([made.corners[~active], corners])
    busy[:] = False
    left = corners[_facing(made, hand, *corners.T) < _TURNED]
    edge = [made.points[left[:, k]] - made.points[left[:, k - 1]] for k in range(3)]
    longest = np.sqrt(np.maximum.reduce([np.square(one).sum(axis=1) for one in edge]))
    high = np.sqrt(np.square(np.cross(edge[0], edge[1])).sum(axis=1)) > _HIGH * fit.chord_mm * longest
    busy[made.face[left[high, 0]]] = True
    return busy


def _facing(made: Triangulation, hand: Array, a: Index, b: Index, c: Index) -> Array:
    """Cosines between triangles and the normals at their vertices, at best; 1 for those of no extent."""
    one, two, three = (picked(made.points, x) for x in (a, b, c))
    across = np.cross(two - one, three - one) * hand[made.face[a], None]
    length = _lengths(across)
    cosines = [np.einsum("nd,nd->n", across, picked(made.normals, x)) for x in (a, b, c)]
    extent = length > _NO_AREA
    return np.where(extent, np.maximum.reduce(cosines) / np.where(extent, length, 1.0), 1.0)


def _lengths(vectors: Array) -> Array:
    return np.asarray(np.sqrt(np.einsum("nd,nd->n", vectors, vectors)))


def _flipped(made: Triangulation, fit: Fit) -> Net:
    """Triangles after flips to diagonals along which the surface bends less."""
    net = Net(made.corners, made.uv)
    face, used = made.face[made.corners[:, 0]], np.flatnonzero(np.bincount(made.corners.ravel()))
    bend = np.zeros((3, len(made.face)))
    bend[:, used] = fit.bends(made.face[used], made.uv[used]).T / (16 * fit.allowed_mm)  # half of each end of a side
    u0, u1, v0, v1 = fit.surfaces.domain[face].T
    least = _FLAT * (u1 - u0) * (v1 - v0)

    def sag(a: Index, b: Index) -> Array:
        du, dv = np.abs(made.uv[a] - made.uv[b]).T
        by_uu, by_uv, by_vv = bend[:, a] + bend[:, b]
        return np.asarray(by_uu * du * du + 2 * by_uv * du * dv + by_vv * dv * dv)

    side = net.inner()
    for _ in range(_FLIPS):
        now = sag(*net.ends(side))
        side, now = side[now > _LONG], now[now > _LONG]
        then = sag(*net.other_ends(side))
        better = then < _BETTER * now
        side, gain = side[better], (now - then)[better]
        after = net.areas_after(side)
        open_ = after.min(axis=0) > np.maximum(_THIN * after.sum(axis=0), least[side // 3])
        if not open_.any():
            break
        flipped = net.flip(side[open_], gain[open_])
        # What lies about a flipped side is looked at again.
        about = np.zeros(len(net.mate), bool)
        about[side[open_]] = True
        for triangle in (flipped // 3, net.mate[net.following[flipped]] // 3):
            for k in range(3):
                place = 3 * triangle + k
                about[place] = True
        about[net.mate < 0] = False
        either = np.flatnonzero(about)
        about[:] = False
        about[np.minimum(either, net.mate[either])] = True
        side = np.flatnonzero(about)
    return net


def _add_middles(made: Triangulation, a: Index, b: Index, fit: Fit) -> None:
    """Add vertices at the middles in (u, v) of sides from a to b (n,), in place."""
    uv, face = (made.uv[a] + made.uv[b]) / 2, made.face[a]
    points, normals = fit.surfaces.located(face, *uv.T)
    made.points, made.normals = np.concatenate([made.points, points]), np.concatenate([made.normals, normals])
    made.uv, made.face = np.concatenate([made.uv, uv]), np.append(made.face, face)


def _halved(corners: Index, middle: Index) -> Index:
    """Triangles (m, 3) cut at the middles of some sides: middle (m, 3) the vertex on the side across, or -1."""
    count = (middle >= 0).sum(axis=1)
    pieces = [corners[count == 0]]
    # Turned so that the one cut side, or the one left whole, lies across the first corner.
    for cuts in (1, 2):
        at = np.flatnonzero(count == cuts)
        k = np.argmax((middle[at] >= 0) == (cuts == 1), axis=1)
        turned = (k[:, None] + np.arange(3)) % 3
        a, b, c = np.take_along_axis(corners[at], turned, axis=1).T
        ma, mb, mc = np.take_along_axis(middle[at], turned, axis=1).T
        if cuts == 1:
            pieces += [np.stack(x, axis=1) for x in ((a, b, ma), (a, ma, c))]
        else:
            pieces += [np.stack(x, axis=1) for x in ((a, mc, mb), (mc, b, mb), (b, c, mb))]
    at = np.flatnonzero(count == 3)
    (a, b, c), (ma, mb, mc) = corners[at].T, middle[at].T
    pieces += [np.stack(x, axis=1) for x in ((a, mc, mb), (mc, b, ma), (mb, ma, c), (ma, mb, mc))]
    return np.concatenate(pieces)
