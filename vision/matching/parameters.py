"""Parameters of the relations among units: px of the picture, angles in rad.

Chosen on left and right pictures of seven rendered pairs, reported on seven others (`benchmarks/relations.py`).
"""

from dataclasses import dataclass, field
from math import radians


@dataclass(frozen=True)
class RelationParameters:
    """Which pairs of units are related."""

    radius: float = 140.0
    """px: arcs whose gap is greater are not related"""
    region_radius: float = 30.0
    """px: the same where one is a region, which chooses only what is nearest"""
    neighbours: int = 16
    """arcs, at most, that an arc of full salience chooses to be `near` to"""
    least_neighbours: int = 1
    """the same of an arc of no salience"""
    full_salience: float = 15.0
    """px: from there on an arc chooses as many as it may"""
    region_neighbours: int = 1
    """arcs, and regions, that a region chooses to be `near` to: those that touch are related by their borders"""
    region_salience: float = 0.6
    """salience of a region over the root of its area"""
    touch: float = 15.0
    """px added to gaps when neighbours are ranked, so that not all that touch come first"""
    min_salience: float = 1.0
    """px: what is less salient is parallel to nothing and meets nothing: streaks are parallel to streaks by the
    hundred"""
    min_line: float = 15.0
    """px: shorter lines have no direction to speak of"""
    max_bow: float = 0.04
    """share of its chord by which a line may leave it: what is a line in one picture is a flat arc in another"""
    max_angle: float = radians(15.0)
    """rad by which lines may miss being parallel"""
    junction_reach: float = 10.0
    """px: what comes nearer with an end meets"""
    max_centre_sigma: float = 2.0
    """px: a centre less certain says nothing of concentricity"""
    max_centre_distance: float = 8.0
    """px between the centres of concentric arcs"""
    max_radius_change: float = 0.25
    """share of the greater of two equal radii by which they may differ"""


@dataclass(frozen=True)
class ViewParameters:
    """How a predicted view becomes units."""

    spacing_px: float = 4.0
    """px between the points along an arc"""
    least_surface_px: float = 60.0
    """px: surfaces that show less are no units"""
    beside_px: float = 4.0
    """px from an arc at which the surface beside it is looked for"""
    relations: RelationParameters = field(
        default_factory=lambda: RelationParameters(
            radius=140.0, neighbours=40, region_neighbours=6, least_neighbours=40
        )
    )
    """wider than those of pictures, so that what lies at their rim is not missed"""


@dataclass(frozen=True)
class PoseProblemParameters:
    """What of a picture may be what of a predicted view, and at what price; prices are quarters of a natural
    logarithm of odds, as the weights of relations."""

    reach_px: float = 10.0
    """px within which an arc of the picture and one of the view are compared"""
    beside_px: float = 4.0
    """px along the arc between an edge element and the point it belongs to"""
    gate_sigma: float = 3.0
    """standard deviations of pose, arc and `floor_px` that a pair may be off"""
    floor_px: float = 0.5
    """px: what edges of real metal are off beyond their own sigma"""
    max_angle: float = radians(15.0)
    """rad: greatest mean angle between the two"""
    min_overlap: float = 0.3
    """share of the image arc that must lie beside the model arc"""
    angle_sigma: float = radians(5.0)
    """rad: of the mean angle between an arc and its model"""
    loose_price: float = 8.0
    """price of an image arc that does not lie beside its model arc at all, in proportion to what does not"""
    min_region_share: float = 0.88
    """share of a region that must lie on a surface: others run over edges that the picture does not show"""
    spill_price: float = 24.0
    """price of a region that does not lie on its surface at all, in proportion to what does not"""
    null_price: int = 14
    """price of being no part of the model, besides `null_share` of the weight of the relations"""
    null_share: float = 0.9
    """at .9 a primitive needs a tenth of its relations confirmed"""
    covered_share: float = 0.5
    """share of its stretch of a model arc that another image arc may cover better before one is a second line beside"""
    nodes: int = 200
    """of the search: what it has not proved by then it bounds"""


@dataclass(frozen=True)
class MatchingParameters:
    """Everything numeric that decides which primitives are which parts of a view."""

    view: ViewParameters = field(default_factory=ViewParameters)
    pose: PoseProblemParameters = field(default_factory=PoseProblemParameters)
    rivals: int = 2
    """how many rivals of the best pose are matched too, so that the relations say how much they cost more"""
