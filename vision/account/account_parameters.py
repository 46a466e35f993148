"""The parameters of the account of edges, a class a stage."""

from dataclasses import dataclass, field
from math import cos, radians


@dataclass(frozen=True)
class SampleParameters:
    """Which edge elements near predicted edges are considered."""

    reach_px: float = 28.0  # px along the normal: how far an edge may have moved to be found again
    min_cosine: float = cos(radians(18))  # of the greatest angle between an element's normal and the predicted one
    max_along_px: float = 0.75
    """px along the edge: an edge has one element a row or column, so that one lies within this of any normal"""
    small_part_px: float = 500.0  # px of edges up to which those of a part need not be distinguished from each other


@dataclass(frozen=True)
class SupportParameters:
    """When an edge element supports a predicted edge, and what chance would do."""

    tolerance_px: float = 2.0  # px along the normal: pose, model and edges err by less together
    tie_px: float = 0.5
    """px by which another predicted edge must be nearer to take an element: edges that coincide share theirs"""
    crowded_px: float = 3.5
    """px within which parallel edges are not distinguished: the extraction's operator is as wide"""
    crowded_cosine: float = cos(radians(30))  # cosine of the angle within which edges count as parallel there
    chance_px: tuple[float, ...] = (-13.0, -10.0, -7.0, 7.0, 10.0, 13.0)
    """px along the normal: where chance is counted, clear of the edge itself"""


@dataclass(frozen=True)
class SideParameters:
    """Where the model is sampled on either side of predicted edges."""

    step_px: float = 3.0  # px off the edge, to clear its tessellation
    spacing_px: float = 6.0  # px along an edge between places


@dataclass(frozen=True)
class RunParameters:
    """How likely predicted edges show, and what a found share says."""

    stretch_px: float = 20.0  # px of an edge that count as one observation: nearer samples see the same picture
    turn: float = radians(60)  # rad by which an edge turns until what it shows counts by itself
    shown: tuple[float, float] = (6.0, 0.7)  # beta distribution of the found share of an edge that shows: mean .9
    partly: float = 0.4
    """of the edges that do not show, the share that is found in part, any share as likely; the others as by chance"""
    stray: float = 0.1
    """share of the places without an edge where something else is found along it, any share as likely"""
    chance_count: float = 6.0  # stretches that the estimate of chance is worth: texture comes in patches
    chance_px: float = 60.0  # px of an edge at which the chance near it weighs as much as the whole picture's
    least_chance: float = 0.02  # share that chance finds at least
    most_chance: float = 0.6  # share that chance finds at most
    least_shows: float = 0.05  # least probability that an edge shows
    most_shows: float = 0.98  # greatest probability that an edge shows: any edge may lack contrast
    alike: float = 0.35  # by how much unit normals of both sides differ where edges are alike, one standard deviation
    background: float = 1.5  # how far nothing behind an edge is from a surface, in the same measure
    bend: float = 0.5  # how far a corner, a ridge and an occluding edge are from each other, in the same measure
    flat: float = 0.05  # sine of the angle within which one side does not rise over the other
    usual_runs: float = 1.0  # runs that the picture's mean is worth, in addition to the runs that are alike
    most_px: float = 60.0  # px from which a run counts as a whole one
    alike_light: float = 6.0
    """concentration of the beta distribution of the share of a thing's edges that show, about the predicted: the less,
    the more they show, or hide, together"""
    lights: int = 9  # quantiles by which it is sampled
    missing: tuple[float, ...] = (0.1, 0.2, 0.3, 0.45, 0.6)  # shares of its edges that what is not as modelled may lack
    levels: int = 20  # shares at which expectations are summed


@dataclass(frozen=True)
class AccountParameters:
    """All parameters of the account, a field a stage."""

    samples: SampleParameters = field(default_factory=SampleParameters)
    support: SupportParameters = field(default_factory=SupportParameters)
    sides: SideParameters = field(default_factory=SideParameters)
    runs: RunParameters = field(default_factory=RunParameters)
