"""Parameters of the relations among units: px of the picture, angles in rad.

Chosen on left and right pictures of seven rendered pairs, reported on seven others (`benchmarks/relations.py`).
"""

from dataclasses import dataclass
from math import radians


@dataclass(frozen=True)
class RelationParameters:
    """Which pairs of units are related."""

    radius: float = 140.0  # px: arcs whose gap is greater are not related
    region_radius: float = 30.0  # px: the same where one is a region, which chooses only what is nearest
    neighbours: int = 16  # arcs, at most, that an arc of full salience chooses to be `near` to
    least_neighbours: int = 1  # the same of an arc of no salience
    full_salience: float = 15.0  # px: from there on an arc chooses as many as it may
    region_neighbours: int = 1
    """arcs, and regions, that a region chooses to be `near` to: those that touch are related by their borders"""
    region_salience: float = 0.6  # salience of a region over the root of its area
    touch: float = 15.0  # px added to gaps when neighbours are ranked, so that curves that touch do not all come first
    min_salience: float = 1.0
    """px: what is less salient is parallel to nothing and meets nothing: streaks are parallel to streaks by the
    hundred"""
    min_line: float = 15.0  # px: shorter lines have no direction to speak of
    max_bow: float = 0.04
    """share of its chord by which a line may leave it: what is a line in one picture is a flat arc in another"""
    max_angle: float = radians(15.0)  # rad by which lines may miss being parallel
    junction_reach: float = 10.0  # px: what comes nearer with an end meets
    max_centre_sigma: float = 2.0  # px: a centre less certain says nothing of concentricity
    max_centre_distance: float = 8.0  # px between the centres of concentric arcs
    max_radius_change: float = 0.25  # share of the greater of two equal radii by which they may differ
