"""How relations of true partners differ, and how much evidence their agreement is."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerance:
    """Of relations of one kind.

    The distances of units a and b and of labels k and l differ with a standard deviation of `distance` px plus
    `distance_share` of the unit side's, their angles with one of `angle` rad (bearings around the circle), besides
    those that both relations have of their own: so much is due to where arcs are cut and to light.  Of a unit only
    relations of at most `reach` px count, while its labels may have longer ones, so that none at the rim is missed by a
    pixel. `nats` is the evidence of full agreement: the log ratio of the odds of agreement within two standard
    deviations, for true partners and for a wrong label of a.  A difference that is less likely by so much confirms
    nothing.

    Measured on CHOOSING of `benchmarks/relations.py`, left against right pictures of seven rendered pairs with partners
    by the truth of rendering; wrong labels: others within 60 px, arcs within 30 degrees of the direction.
    """

    distance: float
    distance_share: float
    angle: float
    reach: float
    nats: float


FAR = 1e6  # px: no limit
AGREE = 4 / 3  # standard deviations within which agreement is most telling

TOLERANCES = {
    "near": Tolerance(3.0, 0.15, 0.3, 80.0, 3.5),
    "parallel": Tolerance(3.0, 0.225, 0.1125, 60.0, 4.0),
    "junction": Tolerance(2.25, 0.375, 0.45, 3.0, 5.5),
    "concentric": Tolerance(6.0, 0.225, 0.075, FAR, 3.0),
    "equal_radius": Tolerance(6.0, 0.225, 0.075, FAR, 3.0),
    "bounds": Tolerance(18.0, 0.375, 0.45, FAR, 4.0),
    "adjacent": Tolerance(30.0, 0.375, 0.45, FAR, 3.5),
    "surrounds": Tolerance(30.0, 0.375, 0.45, FAR, 3.5),
}
"""Concentric and surrounds are too rare to be measured (10 and 13 relations of partners): as equal_radius and
adjacent."""
