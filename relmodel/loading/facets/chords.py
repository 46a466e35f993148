"""Arcs cut into chords, each once: the faces at both sides of an arc get the same points, and meet without a gap.

Lines are one chord.  Circles are cut evenly, as the CAD kernel's mesher cuts them (`BRepMesh`: half of the chord's
error and of its angle, at least three to an arc).  Other arcs are cut where a density of chords (of the turn of the
tangent and of the sagitta) adds up to whole numbers, then halved where a chord is still too far off.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from relmodel.geometry.curves import Curves

Array = npt.NDArray[np.float64]
Index = npt.NDArray[np.int64]
Bools = npt.NDArray[np.bool_]

EVEN = ("line", "circle", "degenerate")
_SAMPLES = 8  # intervals of a smooth piece of an arc in which its turn is measured
_KINK_RAD = 0.01  # where pieces meet at a larger angle a chord ends
_HALVINGS = 6
_SLACK = 1.05  # what a chord may be off more than asked for before it is halved
_FLAT = 1e-6  # chords: an arc that asks for fewer is straight


@dataclass(frozen=True)
class Chords:
    """Ends of the chords of each arc, ascending: those of arc i are `first[i]` to `first[i + 1]` of t and points."""

    t: Array
    points: Array
    first: Index

    @property
    def count(self) -> Index:
        """Chords of each arc (n,)."""
        return np.diff(self.first) - 1

    def replaced(self, curves: Curves, others: dict[int, Array]) -> Chords:
        """With the parameters of some arcs replaced."""
        arc = np.repeat(np.arange(len(self.first) - 1), np.diff(self.first))
        keep = ~np.isin(arc, list(others))
        which = np.repeat(list(others), [len(t) for t in others.values()])
        return _chords(curves, np.append(arc[keep], which), np.concatenate([self.t[keep], *others.values()]))


def cut(curves: Curves, chord_mm: float, chord_rad: float) -> Chords:
    """Chords of all arcs, at most `chord_mm` off them, along which the arc turns by at most `chord_rad`."""
    circle, degenerate = curves.kind == "circle", curves.kind == "degenerate"
    radius = np.where(circle, curves.radius, 1.0)
    step = np.minimum(chord_rad, 2 * np.arccos(np.clip(1 - chord_mm / radius, -1, 1)))
    # A degenerate arc has no length; what ends in it turns about it, as often as by an angle where that is none.
    extent = np.where(degenerate, np.minimum(curves.t1 - curves.t0, 2 * np.pi), curves.t1 - curves.t0)
    count = np.maximum(np.ceil(extent / np.where(degenerate, chord_rad, step) - 1e-9), 3).astype(np.int64)
    count = np.where(circle | degenerate, count, 1)
    even = np.flatnonzero(np.isin(curves.kind.astype(str), EVEN))
    arc, place = numbered(count[even] + 1)
    arc = even[arc]
    share = place / count[arc]
    t = curves.t0[arc] * (1 - share) + curves.t1[arc] * share
    free = np.flatnonzero(~np.isin(curves.kind.astype(str), EVEN))
    if not len(free):
        return _chords(curves, arc, t)
    of, ends = _dense(curves, free, chord_mm, chord_rad)
    of, ends = _close(curves, of, ends, chord_mm)
    return _chords(curves, np.append(arc, of), np.append(t, ends))


def numbered(count: Index) -> tuple[Index, Index]:
    """Whose each of `count` (n,) things is, and its number among them."""
    which = np.repeat(np.arange(len(count)), count)
    return which, np.arange(len(which)) - (np.cumsum(count) - count)[which]


def even_shares(total: Array, unit: Index, density: Array, t: Array) -> tuple[Index, Array]:
    """Cuts of units of a line where a density along them adds up to equal parts.

    total: parts of each unit (n,).  unit, t: (m,) places along the units, in order; density: (m,) what each adds to
    that before it (0 at the first of a unit).  Gives the unit and place of each cut, both ends of the unit included.
    """
    along = np.cumsum(np.where(np.append(True, np.diff(unit) != 0), 1.0, density + 1e-12))
    first = np.flatnonzero(np.append(True, np.diff(unit) != 0))
    last = np.append(first[1:], len(unit)) - 1
    which, place = numbered(total.astype(np.int64) + 1)
    share = place / total[which]
    cuts = np.interp(along[first][which] + share * (along[last] - along[first])[which], along, t)
    return which, np.where(place == 0, t[first][which], np.where(share == 1, t[last][which], cuts))


def _dense(curves: Curves, free: Index, chord_mm: float, chord_rad: float) -> tuple[Index, Array]:
    """Arcs and parameters of the ends of chords by density; smooth pieces that meet in a kink are cut apart."""
    row, start, end = curves.spans(free)
    t = (start[:, None] + (end - start)[:, None] * np.linspace(0, 1, _SAMPLES + 1)).ravel()
    points, by = curves.evaluate(np.repeat(row, _SAMPLES + 1), t)
    speed = np.linalg.norm(by, axis=1, keepdims=True)
    by = (by / np.where(speed > 0, speed, 1.0)).reshape(len(row), -1, 3)
    points = points.reshape(len(row), -1, 3)
    turn = 2 * np.arcsin(np.clip(np.linalg.norm(np.diff(by, axis=1), axis=2) / 2, 0, 1))
    length = np.linalg.norm(np.diff(points, axis=1), axis=2)
    density = np.zeros((len(row), _SAMPLES + 1))
    density[:, 1:] = np.maximum(turn / chord_rad, np.sqrt(turn * length / (8 * chord_mm)))
    kink = np.linalg.norm(by[1:, 0] - by[:-1, -1], axis=1) > _KINK_RAD
    unit = np.cumsum(np.append(0, (np.diff(row) != 0) | kink))
    total = np.asarray(np.bincount(unit, density.sum(axis=1)), float)
    total = np.where(total > _FLAT, np.maximum(np.ceil(total), 2), 1.0)
    which, cuts = even_shares(total, np.repeat(unit, _SAMPLES + 1), density.ravel(), t)
    first = np.flatnonzero(np.append(True, np.diff(unit) != 0))
    arc = row[first][which]
    twice = np.append(False, (np.diff(which) != 0) & (np.diff(arc) == 0))  # where units of an arc meet
    return arc[~twice], cuts[~twice]


def _close(curves: Curves, arc: Index, t: Array, chord_mm: float) -> tuple[Index, Array]:
    """Ends of chords (n,), in order, with those halved that are further from their arc than allowed."""
    fresh = np.flatnonzero(np.diff(arc) == 0)
    for _ in range(_HALVINGS):
        start, end = (curves.evaluate(arc[fresh + k], t[fresh + k])[0] for k in (0, 1))
        middle = (t[fresh] + t[fresh + 1]) / 2
        off = np.linalg.norm(beside(start, end, curves.evaluate(arc[fresh], middle)[0]), axis=1)
        wide = off > _SLACK * chord_mm
        if not wide.any():
            break
        at, middle = fresh[wide] + 1, middle[wide]
        arc, t = np.insert(arc, at, arc[at]), np.insert(t, at, middle)
        added = at + np.arange(len(at))
        fresh = np.stack([added - 1, added], axis=1).ravel()
    return arc, t


def beside(a: Array, b: Array, points: Array) -> Array:
    """From the nearest places of chords from a to b to points, all (n, 3)."""
    along, arm = b - a, points - a
    square = np.einsum("nd,nd->n", along, along)
    share = np.einsum("nd,nd->n", arm, along) / np.where(square > 0, square, 1.0)
    return np.asarray(arm - np.clip(share, 0, 1)[:, None] * along)


def _chords(curves: Curves, arc: Index, t: Array) -> Chords:
    order = np.lexsort((t, arc))
    first = np.concatenate([[0], np.cumsum(np.bincount(arc, minlength=len(curves)))])
    points = np.ascontiguousarray(curves.evaluate(arc[order], t[order])[0])
    return Chords(t[order], points, first)
