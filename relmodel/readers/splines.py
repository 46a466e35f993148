"""Splines of the CAD kernel, and polylines, as columns; runs in the child process of the reader."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np

from relmodel.arrays import Floats, Ints32, Ragged
from relmodel.model.model import Table


class Spline(NamedTuple):
    """A b-spline curve; poles (n, d), weights None where it is not rational."""

    degree: int
    periodic: bool
    knots: Floats
    multiplicities: Ints32
    poles: Floats
    weights: Floats | None


def spline_of(curve: Any) -> Spline:
    """A spline curve of the kernel, in two or three dimensions."""
    knots, poles = range(1, curve.NbKnots() + 1), range(1, curve.NbPoles() + 1)
    return Spline(
        curve.Degree(),
        curve.IsPeriodic(),
        np.array([curve.Knot(i) for i in knots]),
        np.array([curve.Multiplicity(i) for i in knots], np.int32),
        np.array([curve.Pole(i).Coord() for i in poles]),
        np.array([curve.Weight(i) for i in poles]) if curve.IsRational() else None,
    )


def polyline(knots: Floats, points: Floats) -> Spline:
    """A line through points (n, d) at the parameters `knots` (n,)."""
    return Spline(1, False, knots, np.r_[2, np.ones(len(knots) - 2), 2].astype(np.int32), points, None)


def spline_columns(curves: Sequence[Spline | None]) -> Table:
    """Columns of spline curves; None gives nulls."""
    whole = all(c is not None for c in curves)
    degree = [None if c is None else c.degree for c in curves]
    periodic = [None if c is None else c.periodic for c in curves]
    return {
        "degree": np.array(degree, np.int64) if whole else degree,
        "periodic": np.array(periodic, bool) if whole else periodic,
        "rational": np.array([c is not None and c.weights is not None for c in curves], bool),
        "knots": Ragged.pack([None if c is None else c.knots for c in curves]),
        "multiplicities": Ragged.pack([None if c is None else c.multiplicities for c in curves], np.int32),
        "poles": Ragged.pack([None if c is None else c.poles for c in curves]),
        "weights": Ragged.pack([None if c is None else c.weights for c in curves]),
    }


def surface_spline_columns(splines: list[tuple[int, Any]]) -> Table:
    surfaces = [s for _, s in splines]
    out: Table = {"surface_no": np.array([row for row, _ in splines], np.int64)}
    for way in ("U", "V"):
        low = way.lower()
        counts = [getattr(s, f"Nb{way}Knots")() for s in surfaces]
        out[f"{low}_degree"] = np.array([getattr(s, f"{way}Degree")() for s in surfaces], np.int64)
        out[f"{low}_periodic"] = np.array([getattr(s, f"Is{way}Periodic")() for s in surfaces], bool)
        out[f"{low}_poles"] = np.array([getattr(s, f"Nb{way}Poles")() for s in surfaces], np.int64)
        for name, column, form in (("Knot", "knots", np.float64), ("Multiplicity", "multiplicities", np.int32)):
            every = [(getattr(s, f"{way}{name}"), count) for s, count in zip(surfaces, counts, strict=True)]
            out[f"{low}_{column}"] = Ragged.pack([[get(i + 1) for i in range(count)] for get, count in every], form)
    rational = [s.IsURational() or s.IsVRational() for s in surfaces]
    out["rational"] = np.array(rational, bool)
    nets = [[(i, j) for i in range(1, s.NbUPoles() + 1) for j in range(1, s.NbVPoles() + 1)] for s in surfaces]
    out["poles"] = Ragged.pack([[s.Pole(i, j).Coord() for i, j in net] for s, net in zip(surfaces, nets, strict=True)])
    out["weights"] = Ragged.pack(
        [[s.Weight(i, j) for i, j in net] if r else None for s, net, r in zip(surfaces, nets, rational, strict=True)]
    )
    return out
