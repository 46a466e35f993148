"""Osculating circles of arcs: each arc near one of its points as the circle that touches it there, with its lateral
variance."""

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Indices
from relmodel.columns import Rows
from vision.extraction import covariances
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, FREE, LINE, Arcs
from vision.extraction.ellipses import Ellipses
from vision.extraction.extraction_parameters import JunctionParameters
from vision.extraction.refined_polylines import measure_from_ellipses


@dataclass(frozen=True)
class OsculatingCircles(Rows):
    """Circles that touch arcs, columns of one length n: a point (`x`, `y`) of each, the unit tangent (`tx`, `ty`)
    there, and the `curvature` (1/px) towards the normal (-ty, tx).  `variance` (n, 3): that across the curve, s px
    further on, is c0 + c1 s + c2 s^2 (px^2)."""

    x: Floats
    y: Floats
    tx: Floats
    ty: Floats
    curvature: Floats
    variance: Floats

    def flipped(self, rows: Bools) -> "OsculatingCircles":
        """The same curves, those of the mask `rows` walked the other way."""
        sign = np.where(rows, -1.0, 1.0)
        variance = self.variance * np.column_stack([np.ones_like(sign), sign, np.ones_like(sign)])
        return OsculatingCircles(self.x, self.y, sign * self.tx, sign * self.ty, sign * self.curvature, variance)

    def points(self, s: Floats) -> Floats:
        """(n, k, 2) points of the curves, `s` (n, k) px along them from where they touch."""
        x, y, tx, ty, k = (c[:, None] for c in (self.x, self.y, self.tx, self.ty, self.curvature))
        half = 0.5 * k * s
        chord = s * np.sinc(half / np.pi)
        forth, aside = chord * np.cos(half), chord * np.sin(half)
        return np.stack([x + forth * tx - aside * ty, y + forth * ty + aside * tx], axis=-1)

    def normals(self, s: Floats) -> Floats:
        """(n, k, 2) unit normals there."""
        turn = self.curvature[:, None] * s
        tx, ty = self.tx[:, None], self.ty[:, None]
        return np.stack([-np.sin(turn) * tx - np.cos(turn) * ty, -np.sin(turn) * ty + np.cos(turn) * tx], axis=-1)

    def locate(self, x: Floats, y: Floats) -> tuple[Floats, Floats]:
        """Of points (n,), one a curve: how far along it, and how far across on the side of the normal, they are."""
        dx, dy, k = x - self.x, y - self.y, self.curvature
        u, v = dx * self.tx + dy * self.ty, dy * self.tx - dx * self.ty
        power = v - 0.5 * k * (u * u + v * v)  # of the point by the circle, over twice its radius
        across = 2.0 * power / (1.0 + np.sqrt(np.maximum(1.0 - 2.0 * k * power, 0.0)))
        bent = np.abs(k) > 1e-9
        along = np.where(bent, np.arctan2(k * u, 1.0 - k * v) / np.where(bent, k, 1.0), u)
        return along, across

    def sigma(self, s: Floats, least: float) -> Floats:
        """Standard deviation (n,) across the curves, `s` (n,) px along them, `least` px at least."""
        c0, c1, c2 = self.variance.T
        return np.asarray(np.sqrt(np.maximum(c0 + s * (c1 + s * c2), least**2)))


def find_osculating_circles(
    arcs: Arcs, point: Indices, x: Floats, y: Floats, p: JunctionParameters
) -> OsculatingCircles:
    """Arcs near places (`x`, `y`) on their polylines, `point` (n,) the nearest of these; walked from start to end."""
    n, arc = len(point), arcs.chains.chain_of_member[point]
    first, last = arcs.offsets[arc], arcs.offsets[arc + 1] - 1
    x, y = x.copy(), y.copy()
    before, after = np.maximum(point - p.tangent_points, first), np.minimum(point + p.tangent_points, last)
    tangent = np.column_stack([arcs.x[after] - arcs.x[before], arcs.y[after] - arcs.y[before]])
    tangent /= np.maximum(np.linalg.norm(tangent, axis=1, keepdims=True), 1e-12)
    curvature, variance = np.zeros(n), np.zeros((n, 3))
    kind = arcs.kind[arc]

    line = kind == LINE
    which = arc[line]
    tangent[line] = arcs.direction[which]
    start = np.column_stack([arcs.start_x, arcs.start_y])[which]
    along = np.sum((np.column_stack([x, y])[line] - start) * tangent[line], axis=1)
    x[line], y[line] = (start + along[:, None] * tangent[line]).T
    t, c = along - 0.5 * arcs.length[which], arcs.covariance[which]
    variance[line] = _quadratic(c[:, :2, :2], np.column_stack([np.ones_like(t), t]), np.array([0.0, 1.0]))

    round_ = kind == CIRCULAR
    which = arc[round_]
    centre, radius = np.column_stack([arcs.centre_x, arcs.centre_y])[which], arcs.radius[which]
    spoke = np.column_stack([x, y])[round_] - centre
    spoke /= np.maximum(np.linalg.norm(spoke, axis=1, keepdims=True), 1e-12)
    x[round_], y[round_] = (centre + radius[:, None] * spoke).T
    tangent[round_] = _along(spoke, tangent[round_])
    curvature[round_] = _towards(spoke, tangent[round_]) / radius
    turning = np.column_stack([tangent[round_] / radius[:, None], np.zeros(len(which))])
    jacobian = np.column_stack([spoke, np.ones(len(which))])
    variance[round_] = _quadratic(arcs.covariance[which][:, :3, :3], jacobian, turning)

    oval = kind == ELLIPTIC
    which = arc[oval]
    ellipses = Ellipses(
        *(getattr(arcs, name)[which] for name in ("centre_x", "centre_y", "radius", "radius2", "axis_angle", "sigma"))
    )
    each = np.arange(len(which))
    seen = measure_from_ellipses(x[oval], y[oval], ellipses, each, np.ones(len(which)))
    normal = np.column_stack([seen.nx, seen.ny])
    x[oval], y[oval] = x[oval] - seen.distance * seen.nx, y[oval] - seen.distance * seen.ny
    tangent[oval] = _along(normal, tangent[oval])
    curvature[oval] = _towards(normal, tangent[oval]) * seen.bias
    ahead = [
        covariances.of_ellipses(
            px, py, measure_from_ellipses(px, py, ellipses, each, np.ones(len(which))), ellipses, each
        )
        for px, py in ((x[oval] + step * tangent[oval].T) for step in (-1.0, 0.0, 1.0))
    ]
    variance[oval] = _quadratic(arcs.covariance[which][:, :5, :5], ahead[1], 0.5 * (ahead[2] - ahead[0]))

    # a free curve as the parabola through three of its points
    free = kind == FREE
    at, low, high = point[free], first[free], last[free]
    middle = np.clip(at, np.minimum(low + p.tangent_points, high), np.maximum(high - p.tangent_points, low))
    three = [
        np.column_stack([arcs.x[q], arcs.y[q]])
        for q in (np.maximum(middle - p.tangent_points, low), middle, np.minimum(middle + p.tangent_points, high))
    ]
    to, on = three[1] - three[0], three[2] - three[1]
    a, b = np.hypot(*to.T), np.hypot(*on.T)
    chord = three[2] - three[0]
    bend = 2.0 * (to[:, 0] * on[:, 1] - to[:, 1] * on[:, 0]) / np.maximum(a * b * np.hypot(*chord.T), 1e-9)
    turn = (
        bend
        * np.sum((np.column_stack([x, y])[free] - 0.5 * (three[0] + three[2])) * chord, axis=1)
        / np.maximum(a + b, 1e-9)
    )
    way = np.arctan2(chord[:, 1], chord[:, 0]) + turn
    tangent[free] = np.column_stack([np.cos(way), np.sin(way)])
    curvature[free] = bend
    # prolonged from an end, it strays as three points a apart let it: (1 + 20 s^2 / a^2) times their variance
    spread = arcs.point_sigma[at] ** 2
    variance[free] = np.column_stack([spread, 0.0 * spread, 20.0 * spread / np.maximum(0.5 * (a + b), 1.0) ** 2])
    # parameters that nearly determine each other have no covariance; place and direction in the middle are known still
    unknown = ~np.isfinite(variance).all(axis=1)
    sigma, lean = arcs.sigma[arc[unknown]], arcs.angle_sigma[arc[unknown]]
    variance[unknown] = np.column_stack([sigma**2, 0.0 * sigma, lean**2])
    return OsculatingCircles(x, y, tangent[:, 0], tangent[:, 1], curvature, variance)


def _along(normal: Floats, roughly: Floats) -> Floats:
    """Unit tangents across unit normals (n, 2), on the side of the directions `roughly`."""
    tangent = np.column_stack([-normal[:, 1], normal[:, 0]])
    return np.asarray(np.where(np.sum(tangent * roughly, axis=1, keepdims=True) < 0.0, -tangent, tangent))


def _towards(outward: Floats, tangent: Floats) -> Floats:
    """1 where the normal (-ty, tx) points against `outward` (n, 2), to the centre of curvature, -1 elsewhere."""
    return np.asarray(np.where(tangent[:, 0] * outward[:, 1] - tangent[:, 1] * outward[:, 0] < 0.0, 1.0, -1.0))


def _quadratic(covariance: Floats, jacobian: Floats, change: Floats) -> Floats:
    """(n, 3): c0 + c1 s + c2 s^2, the variance of (jacobian + s change) . parameters; covariance (n, k, k)."""
    change = np.broadcast_to(change, jacobian.shape)
    return np.stack(
        [
            np.einsum("ni,nij,nj->n", jacobian, covariance, jacobian),
            2.0 * np.einsum("ni,nij,nj->n", jacobian, covariance, change),
            np.einsum("ni,nij,nj->n", change, covariance, change),
        ],
        axis=1,
    )
