"""Parameters of the match of a picture to a predicted view: px of the picture, angles in rad."""

from dataclasses import dataclass, field
from math import radians

from vision.relations.relation_parameters import RelationParameters


@dataclass(frozen=True)
class ViewParameters:
    """How a predicted view becomes units."""

    spacing_px: float = 4.0
    """px between the points along an arc"""
    least_surface_px: float = 60.0
    """px: surfaces that show less are no units"""
    side_px: float = 4.0
    """px from an arc at which the surface beside it is looked for"""
    relations: RelationParameters = field(
        default_factory=lambda: RelationParameters(
            radius=140.0, neighbours=40, region_neighbours=6, least_neighbours=40
        )
    )
    """wider than those of pictures, so that what lies at their rim is not missed"""


@dataclass(frozen=True)
class PoseProblemParameters:
    """Which primitives of a picture may be which parts of a predicted view, and at what price; prices are quarters of a
    natural logarithm of odds, as the weights of relations."""

    search: str = "dual_ascent"
    """how the best labelling is sought: `relmodel.labelling.solve.MODES`"""
    reach_px: float = 10.0
    """px within which an arc of the picture and one of the view are compared"""
    along_px: float = 4.0
    """px along the arc between an edge element and the point it belongs to"""
    gate_sigma: float = 3.0
    """standard deviations of pose, arc and `floor_px` that a pair may be off"""
    floor_px: float = 0.5
    """px: standard deviation of edges of real metal beyond their own sigma"""
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
