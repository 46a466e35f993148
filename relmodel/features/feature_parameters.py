"""The parameters of recognition, a class a subject: every number that decides which features, relations and contacts
a shape has.

Lengths in mm, angles in rad.  Values without a named source are rules of the shop or were set by judgement,
and hold on the parts of the tests."""

from dataclasses import dataclass, field
from math import pi, radians, sin


@dataclass(frozen=True)
class CommonParameters:
    """Tolerances that all kinds of features share."""

    length_mm: float = 1e-3  # mm, for "on one axis", "of one radius"
    angle_rad: float = 1e-5  # rad, for "along one axis"
    steep: float = sin(radians(10))  # sine of the greatest draft of walls
    whole_turn_rad: float = 1.9 * pi  # rad from which what is turned counts as closed
    draft_rad: float = radians(0.5)  # rad from which walls have a draft; their drafts agree to a fifth of it
    bins: int = 720  # of the full turn, for the union of angles
    most_mesh_surfaces: int = 20_000  # surfaces of a mesh beyond which it is a scan and not a tessellated part
    form_quantum: float = 1e-2  # mm and mm2 to which forms of one class agree
    class_digits: int = 4  # decimals of mm and rad to which dimensions of one class agree


@dataclass(frozen=True)
class HoleParameters:
    """What is drilled in one go."""

    reach: float = 10.0  # length of a gap, in diameters, that a drill crosses
    air: float = 3.0
    """length of such a gap to what is drilled on either side: the walls of a housing are bored one by one"""
    within: float = 0.9  # share of the radius within which there is nothing but air
    least_turn_rad: float = 1.2 * pi  # least turn of a cylinder: one that is open further is cut out of a side


@dataclass(frozen=True)
class HollowParameters:
    """Which floors with an open side are of pockets, and which walls go around an opening."""

    mostly: float = 0.5
    """share of the boundary of a pocket that another may not have cut away, and of each of its sides"""
    pocket_walls: int = 4  # least walls of a pocket with an open side
    opening_walls: int = 3  # least walls of an opening, which face each other all around
    within: float = 0.9  # share of the way to a wall that is looked through
    ellipse_mm: float = 1e-2  # mm by which walls may be off the ellipse that they are


@dataclass(frozen=True)
class SlotParameters:
    """Which walls make a slot that runs out at a side, and which a step."""

    leaning: float = sin(radians(60))  # sine of the angle by which walls may lean, back or over the floor
    even_rad: float = radians(1)  # rad by which walls that lean back differ at most
    wall_share: float = 0.2  # share of a floor's extent that a wall has at least
    keeps: float = 0.9  # length of a leaning wall to that of the floor, at most the inverse of this
    corners: int = 2  # corners in which two pairs of walls may not meet: the bend of a channel is one
    flat_rad: float = radians(170)  # rad: walls of a V that open further are a bent face
    over: float = sin(radians(10))  # sine by which a wall may lean over the floor of a step
    spans: float = 0.9  # share of a step's floor that its wall runs along, and of the wall that the floor does


@dataclass(frozen=True)
class ThinParameters:
    """What is thin: ribs, flanges and webs."""

    thin: float = 0.6  # thickness of a rib or flange to its height
    touching: float = 0.01  # share of the smaller of two planes that one covers at least
    under: float = 0.3  # share of a floor that has the web under it
    thin_web: float = 0.2  # thickness of a web to its width
    contact: float = 0.6  # length of a foot to that of the side on it
    share: float = 0.3  # length of a flange to that of the side that it is of
    tall: float = 0.3  # height of a flange to that of the part
    same_mm: float = 1e-2  # mm, thickness and middle of the segments of one rib
    long: float = 2.0  # length of a rib to its thickness: what is shorter is a post
    lean: tuple[float, float] = (sin(radians(0.5)), sin(radians(15)))  # sines between which a side with draft leans
    gusset: float = 0.75  # area of the side of a gusset to that of the rectangle around it, at most
    crossing: float = 10.0
    """times its thickness that segments of a rib are apart: what crosses it parts them, with its corners"""


@dataclass(frozen=True)
class StandingParameters:
    """Bosses, lugs, and flanges around a shaft."""

    flat: float = 0.5  # thickness of a flange to its radius
    wider: float = 1.2  # radius of a flange to that of its shaft
    gap_rad: float = 0.5  # rad without a point: more than a facet spans
    end_of_a_lug_rad: tuple[float, float] = (0.6 * pi, 1.9 * pi)
    """turn of the rounded end of a lug; a full turn is a boss"""
    long: float = 5.0  # length to width of an island that is a rib, however low


@dataclass(frozen=True)
class BlendParameters:
    """Edges that are rounded or cut off."""

    half_turn_rad: float = 0.95 * pi  # rad: a half cylinder between parallel walls is the end of a slot
    slant_rad: tuple[float, float] = (radians(15), radians(75))  # rad between a chamfer and the faces next to it
    narrow: float = 0.8  # greatest ratio of a chamfer's width to that of the faces next to it
    open_rad: float = 0.3  # rad without a point: more than one facet of a mesh spans
    bent: float = 0.02  # 1 - cos of the least turn that is worth rounding off, and of that to a full one
    same_line: float = 1e-3  # mm and rad within which axes are one line
    same_radius_mm: float = 1e-3  # mm within which radii are one


@dataclass(frozen=True)
class PatternParameters:
    """Rows, circles and grids of holes."""

    same: float = 1e-2  # mm, rad within which places are where the pattern has them
    nearest: int = 8  # neighbours that are tried as the next of a row or circle
    least: int = 3  # holes of a row or circle
    surely_a_circle: int = 5  # holes of a circle that cannot be corners of a grid
    filled: float = 2 / 3  # share of the places of a circle that holes take at least


@dataclass(frozen=True)
class CircleParameters:
    """Which pairs of circles are related, mm."""

    least_radius: float = 2.5  # mm: smaller circles are drilled by the hundred, and pictures show their radius badly
    greatest_radius: float = 400.0  # mm: of greater circles a picture shows a flat arc, whose centre is anywhere
    least_distance: float = 20.0  # mm between centres, from which on their line has a direction
    greatest_distance: float = 500.0  # mm between centres: as far as one view reaches
    radius_step: float = 0.1  # mm: radii within it are one class
    distance_step: float = 0.5  # mm: distances likewise
    cosine_step: float = 0.02  # cosines likewise
    most_of_class: int = 64  # pairs of a class that are kept, evenly among all
    most_parts: int = 2000  # parts of an object that are looked at, the greatest
    most_circles: int = 3000  # circles of an object that are related, those of the rarest radii


@dataclass(frozen=True)
class FeatureParameters:
    """All of them, a field a subject."""

    common: CommonParameters = field(default_factory=CommonParameters)
    holes: HoleParameters = field(default_factory=HoleParameters)
    hollows: HollowParameters = field(default_factory=HollowParameters)
    slots: SlotParameters = field(default_factory=SlotParameters)
    thin: ThinParameters = field(default_factory=ThinParameters)
    standing: StandingParameters = field(default_factory=StandingParameters)
    blends: BlendParameters = field(default_factory=BlendParameters)
    patterns: PatternParameters = field(default_factory=PatternParameters)
    circles: CircleParameters = field(default_factory=CircleParameters)


DEFAULTS = FeatureParameters()
