"""How far two relations of one kind may differ and yet agree, and what it tells that they do."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerance:
    """Of relations of one kind.

    Those of units a and b and of labels k and l agree if their distances differ by at most `distance` px plus
    `distance_share` of the unit side's, and their angles by at most `angle` rad (bearings around the circle).  A unit
    calls on relations of at most `reach` px only, while its labels may have longer ones: what lies at the rim is not
    missed for a pixel.  `weight` is 4 times the logarithm of the ratio of the odds of agreement between true partners
    and where a is given a wrong label.

    Measured on CHOOSING of `benchmarks/relations.py`, left against right pictures of seven rendered pairs with partners
    by the truth of rendering; wrong labels: others within 60 px, arcs within 30 degrees of the direction.
    """

    distance: float
    distance_share: float
    angle: float
    reach: float
    weight: int


FAR = 1e6  # px: no limit

TOLERANCES = {
    "near": Tolerance(4.0, 0.2, 0.4, 80.0, 14),
    "parallel": Tolerance(4.0, 0.3, 0.15, 60.0, 16),
    "junction": Tolerance(3.0, 0.5, 0.6, 3.0, 22),
    "concentric": Tolerance(8.0, 0.3, 0.1, FAR, 12),
    "equal_radius": Tolerance(8.0, 0.3, 0.1, FAR, 12),
    "bounds": Tolerance(24.0, 0.5, 0.6, FAR, 16),
    "adjacent": Tolerance(40.0, 0.5, 0.6, FAR, 14),
    "surrounds": Tolerance(40.0, 0.5, 0.6, FAR, 14),
}
"""Concentric and surrounds are too rare to be measured (10 and 13 relations of partners): weighed as equal_radius and
adjacent."""
