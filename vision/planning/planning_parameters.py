"""The parameters of a plan of views."""

from dataclasses import dataclass
from math import radians


@dataclass(frozen=True)
class PlanningParameters:
    """Which views are tried, and what counts as checked by one."""

    pixel_mm: float = 0.6
    """mm of the part in a pixel at the distance that is taken where none is given: finer than a change that counts"""
    step: float = 0.6  # share of a view's width and height from one view to the next: neighbours overlap
    tilt: float = radians(35)
    """rad: beside the view straight on, one tilted to each side shows the walls of what is deep"""
    clear_mm: float = 150.0  # mm about a camera in which nothing may lie
    least_px: float = 120.0
    """px of edges that can be distinguished from others, over all cameras, from which a part or feature counts as
    checked: of those of the demonstration's pairs with as many 11 in 12 were decided, of those with less 1 in 8"""
    enough: float = 0.95  # share of what any view could check at which a plan ends
    near_mm: float = 1.0  # mm: how exactly an arm must reach a view
    near: float = radians(0.1)  # rad likewise
    steps: int = 25  # of the search for the joints of a view
    starts: int = 5  # of that search at random, after those of the view before
    arm_mm: float = 1000.0  # mm that a rad counts in it
    joint_mm: float = 100.0
    """mm from one value to the next of a joint of a carrier with too few joints to reach any pose"""
    joint: float = radians(15)  # rad likewise
    most_joints: int = 400  # values of all its joints together that are tried


DEFAULTS = PlanningParameters()
