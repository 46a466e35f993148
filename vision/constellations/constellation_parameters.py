"""Parameters of the join of circles in space with those of the model, and of the poses that it gives: mm, rad."""

from dataclasses import dataclass
from math import radians


@dataclass(frozen=True)
class JoinParameters:
    """Which pairs of circles are alike; sizes and distances are those that a load relates."""

    radius_mm: float = 1.0
    """mm by which radii may differ"""
    radius_share: float = 0.05
    """share of a radius by which it may differ beyond that"""
    distance_mm: float = 2.0
    """mm by which distances of centres may differ"""
    cosine: float = 0.12
    """by which cosines of the angles of normals and connecting line may differ"""
    along: float = 0.9
    """cosine of normal and connecting line beyond which they leave a turn about both open"""
    most_of_relation: int = 64
    """pairs of the model that a relation is joined with, evenly among all it is like"""
    most: int = 20_000
    """joined pairs, the rarest first, after which no further pair of circles is taken"""


@dataclass(frozen=True)
class PoseParameters:
    """Which poses of joined pairs go on."""

    cell_mm: float = 10.0
    """mm: poses that put what is seen in one such cell"""
    cell_rad: float = 0.08
    """rad: and turn it about alike, vote together"""
    scored: int = 400
    """poses of most votes that are scored, by each of two ways to count"""
    few_points: int = 150
    """points of the scene that all these are scored on"""
    fitted: int = 60
    """poses of these that are fitted to the model's arcs, distinct ones of the best score"""
    points: int = 800
    """points of the scene that these are fitted to and scored on"""
    reaches: tuple[float, ...] = (5.0, 4.0, 3.0, 2.0)
    """mm between a point and an arc in each step of the fit"""
    reach: float = 4.0
    """mm between a point and an arc that may explain it"""
    sigma: float = 2.0
    """mm: standard deviation of points across arcs"""
    parallel: float = 0.97
    """cosine of the directions of a point and the arc that explains it, at least"""
    distinct_mm: float = 12.0
    """mm: poses that put what is seen nearer than this"""
    distinct_rad: float = 0.06
    """rad: and turn it less than this are one"""
    alike_share: float = 0.9
    """share of what the best pose explains, from which on what repeats about a pose is looked at"""
    kept: int = 100
    """distinct poses that go on"""
    sharp_rad: float = radians(5.0)
    """rad between the faces of an arc that shows as an edge"""
    step: float = 8.0
    """mm between points along a scene's arc"""
    most_of_one: float = 200.0
    """mm of an arc that count"""


@dataclass(frozen=True)
class ConstellationParameters:
    """Parameters of finding poses by constellations."""

    join: JoinParameters = JoinParameters()
    poses: PoseParameters = PoseParameters()


DEFAULTS = ConstellationParameters()
