"""Small SVG drawings: courses of arcs, histograms, residuals on the picture, ellipses of uncertainty."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import cv2
import numpy as np
from markupsafe import Markup

from relmodel.arrays import Floats, Ints
from relmodel.text import visible

_MOST_POINTS = 500
_MOST_LETTERS = 26  # of a bar's label: its end tells it apart
_DETAIL_PX = 0.4  # how far a drawn course may leave the points that it stands for: less than a line is wide


def courses(owner: Ints, x: Floats, y: Floats, *, detail: float = _DETAIL_PX) -> dict[int, str]:
    """SVG path data of each owner's points, px; the points of an owner are contiguous.

    Points that a straight piece passes within `detail` are left out (Douglas and Peucker 1973, by OpenCV).
    """
    if not len(owner):
        return {}
    starts = np.flatnonzero(np.r_[True, owner[1:] != owner[:-1]])
    points = np.stack([x, y], axis=1)
    pieces = zip(owner[starts].tolist(), np.split(points, starts[1:]), strict=True)
    return {int(no): course(piece, detail) for no, piece in pieces}


def course(points: Floats, detail: float = _DETAIL_PX) -> str:
    """SVG path data of points (n, 2), px, as `courses` has it."""
    return path_data(np.asarray(cv2.approxPolyDP(points.astype(np.float32), detail, False)[:, 0], float))


def path_data(points: Floats, closed: bool = False) -> str:
    """SVG path data of a polyline (n, 2), px, to a tenth."""
    return "M" + "L".join(f"{u:.1f} {v:.1f}" for u, v in points.tolist()) + ("Z" if closed else "")


def histogram(values: Floats, weights: Floats, *, reach: float = 4.0, bins: int = 40) -> Markup:
    """Histogram of residuals over their standard deviations, with the normal density; the outermost bars include all
    beyond.

    values in standard deviations, weights 0 to 1.
    """
    heights, edges = np.histogram(np.clip(values, -reach, reach), bins, (-reach, reach), weights=weights)
    total = max(float(heights.sum()), 1e-9)
    density = heights / total / (edges[1] - edges[0])
    top = max(float(density.max()), 0.45)
    bars = Markup("").join(
        Markup('<rect x="{:.2f}" y="{:.2f}" width="{:.2f}" height="{:.2f}"/>').format(
            40 * left, 100 * (1 - d / top), 40 * (edges[1] - edges[0]) - 0.5, 100 * d / top
        )
        for left, d in zip(edges[:-1].tolist(), density.tolist(), strict=True)
    )
    at = np.linspace(-reach, reach, 81)
    normal = np.exp(-(at**2) / 2) / np.sqrt(2 * np.pi)
    curve = path_data(np.stack([40 * at, 100 * (1 - normal / top)], axis=1))
    marks = Markup("").join(
        Markup('<text x="{}" y="112" text-anchor="middle">{}</text>').format(40 * k, k) for k in (-4, -2, 0, 2, 4)
    )
    return Markup(
        '<svg class="plot" viewBox="-166 -4 332 120" role="img" aria-label="histogram of residuals">'
        '<g class="bars">{}</g><path class="curve" d="{}"/><path class="axis" d="M-160 100H160"/>{}</svg>'
    ).format(bars, curve, marks)


def residual_map(points: Floats, normals: Floats, residual: Floats, width: int, height: int, scale: float) -> Markup:
    """Residuals (n,) px, along normals (n, 2) from points (n, 2) of the picture, drawn `scale` times as long."""
    ends = points + scale * residual[:, None] * normals
    data = "".join(
        f"M{a:.0f} {b:.0f}L{c:.0f} {d:.0f}" for (a, b), (c, d) in zip(points.tolist(), ends.tolist(), strict=True)
    )
    return Markup(
        '<svg class="plot map" viewBox="-0.5 -0.5 {w} {h}" role="img" aria-label="residuals on the picture">'
        '<rect class="frame" x="-0.5" y="-0.5" width="{w}" height="{h}"/><path class="residual" d="{d}"/></svg>'
    ).format(w=width, h=height, d=data)


def ellipse(covariance: Floats, label: str) -> Markup:
    """One and two standard deviations of a covariance (2, 2) in mm, the longer half axis of two filling the drawing."""
    half = 2 * float(np.sqrt(max(np.linalg.eigvalsh(covariance)[-1], 1e-30)))
    paths = Markup("").join(
        Markup('<path class="ellipse" d="{}"/>').format(
            path_data(ellipse_points(covariance, k) * [80 / half, -80 / half], True)
        )
        for k in (1, 2)
    )
    return Markup(
        '<svg class="plot ellipses" viewBox="-100 -100 200 215" role="img" aria-label="error ellipse {label}">'
        '<path class="axis" d="M-90 0H90M0 -90V90"/>{paths}<text x="0" y="110" text-anchor="middle">{label}: '
        "two sigma at most {half:.2g} mm</text></svg>"
    ).format(label=label, paths=paths, half=half)


def ellipse_points(covariance: Floats, sigmas: float, count: int = 48) -> Floats:
    """Points (count, 2) around the ellipse of so many standard deviations about the origin."""
    values, vectors = np.linalg.eigh(covariance)
    at = np.linspace(0, 2 * np.pi, count, endpoint=False)
    circle = np.stack([np.cos(at), np.sin(at)], axis=1)
    return np.asarray(sigmas * circle * np.sqrt(np.maximum(values, 0)) @ vectors.T)


def bars(labels: Sequence[str], values: Sequence[float], unit: str) -> Markup:
    """A bar a label, the longest as wide as there is room."""
    longest = max((abs(v) for v in values), default=0.0) or 1.0
    drawn = [
        Markup(
            '<text x="176" y="{y}" text-anchor="end">{label}</text>'
            '<rect x="182" y="{top}" width="{wide:.1f}" height="14"/><text x="{end:.1f}" y="{y}">{value:.4g}</text>'
        ).format(
            y=20 * n + 15, top=20 * n + 4, wide=380 * abs(v) / longest, end=188 + 380 * abs(v) / longest,
            label=visible(label)[-_MOST_LETTERS:], value=v,
        )
        for n, (label, v) in enumerate(zip(labels, values, strict=True))
    ]  # fmt: skip
    return Markup(
        '<svg class="plot history counts" viewBox="0 0 640 {}" role="img" aria-label="{} by name">{}</svg>'
    ).format(20 * len(labels) + 8, unit, Markup("").join(drawn))


@dataclass(frozen=True)
class Point:
    """A value of a plot over time: where a click leads, its label, sigma, nominal and limit (of how far it is from the
    nominal, without one of itself) where there are such, and whether it is not as it should be."""

    link: str
    label: str
    value: float
    sigma: float | None = None
    nominal: float | None = None
    limit: float | None = None
    bad: bool = False


def history(points: Sequence[Point], unit: str) -> Markup:
    """Values one after the other with two standard deviations, the nominal and the limits about it; each is a link.

    Of many the last 500 are drawn.
    """
    points = points[-_MOST_POINTS:]
    value = np.array([p.value for p in points])
    sigma, nominal, limit = (
        np.array([np.nan if v is None else v for v in column], float)
        for column in zip(*((p.sigma, p.nominal, p.limit) for p in points), strict=True)
    )
    spread = 2 * np.nan_to_num(sigma)
    above = np.nan_to_num(nominal) + limit  # where nothing is nominal the limit is that of the value itself
    shown = np.concatenate([value - spread, value + spread, nominal - limit, above, nominal])
    low, high = float(np.nanmin(shown)), float(np.nanmax(shown))
    if high - low < 1e-9 * abs(high) + 1e-12:  # of one value
        low, high = low - 0.5 * abs(low) - 1e-6, high + 0.5 * abs(high) + 1e-6
    margin = 0.08 * (high - low)
    x = 60 + 900 * (np.arange(len(points)) + 0.5) / len(points)

    def y(v: Floats) -> Floats:
        return np.asarray(250 - 240 * (v - low + margin) / (high - low + 2 * margin))

    half = 450 / len(points)  # a line goes as far about a value as to the middle of the next
    ends = (x[:, None] + [-half, half]).ravel()
    lines = [
        Markup('<path class="{}" d="{}"/>').format(
            name, path_data(np.column_stack([ends, np.repeat(y(at), 2)])[np.repeat(np.isfinite(at), 2)])
        )
        for name, at in (("nominal", nominal), ("limit", nominal - limit), ("limit", above))
        if np.isfinite(at).any()
    ]
    dots = [
        Markup(
            '<a href="{}"><path class="sigma" d="M{:.1f} {:.1f}V{:.1f}"/>'
            '<circle class="{}" cx="{:.1f}" cy="{:.1f}" r="4">'
            "<title>{}: {:.4g}{} {}</title></circle></a>"
        ).format(
            p.link, u, top, bottom, "bad" if p.bad else "good", u, v, visible(p.label), p.value,
            "" if p.sigma is None else f" \u00b1 {p.sigma:.2g}", unit,
        )
        for p, u, v, top, bottom in zip(points, x, y(value), y(value + spread), y(value - spread), strict=True)
    ]  # fmt: skip
    marks = [
        Markup('<text x="52" y="{:.1f}" text-anchor="end">{:.4g}</text>').format(float(y(np.array(at))), at)
        for at in np.linspace(low, high, 5)
    ]
    return Markup(
        '<svg class="plot history" viewBox="-60 0 1040 270" role="img" aria-label="values over time, {}">'
        '<path class="axis" d="M60 10V250H960"/>{}</svg>'
    ).format(unit, Markup("").join([*marks, *lines, *dots]))
