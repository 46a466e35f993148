"""Parameters of the match of a picture to a predicted view: px of the picture, angles in rad."""

from dataclasses import dataclass, field, replace
from math import radians

from vision.relations.relation_parameters import RelationParameters
from vision.relations.tolerances import FAR, TOLERANCES, Tolerance


@dataclass(frozen=True)
class ViewParameters:
    """How a predicted view becomes units."""

    spacing_px: float = 4.0  # px between the points along an arc
    least_surface_px: float = 60.0  # px: surfaces that show less are no units
    side_px: float = 4.0  # px from an arc at which the surface beside it is looked for
    least_turn: float = 0.25  # share of an ellipse that an arc must run around to have a centre
    conic_px: float = 0.5  # px: rms distance from an ellipse up to which an arc is one
    roundest: float = 0.9  # ratio of the axes from which an ellipse has a radius
    relations: RelationParameters = field(
        default_factory=lambda: RelationParameters(
            radius=140.0, neighbours=40, region_neighbours=6, least_neighbours=40
        )
    )
    """wider than those of pictures, so that what lies at their rim is not missed"""


@dataclass(frozen=True)
class PoseProblemParameters:
    """Which primitives of a picture may be which parts of a predicted view, and at what price in nats, natural
    logarithms of odds."""

    search: str = "dual_ascent"  # how the best labelling is sought: `relmodel.labelling.solve.MODES`
    reach_px: float = 10.0  # px within which an arc of the picture and one of the view are compared
    along_px: float = 4.0  # px along the arc between an edge element and the point it belongs to
    gate_sigma: float = 3.0  # standard deviations of pose, arc and `floor_px` that a pair may be off
    floor_px: float = 0.5  # px: standard deviation of edges of real metal beyond their own sigma
    max_angle: float = radians(15.0)
    """rad: greatest mean angle between the two, three standard deviations, plus what the pose may turn circles by"""
    min_overlap: float = 0.3  # share of the image arc that must lie beside the model arc
    scale: int = 32  # integer cost of a nat
    loose_price: float = 2.0
    """price of an image arc that does not lie beside its model arc at all, in proportion to what does not"""
    min_region_share: float = 0.88
    """share of a region that must lie on a surface: others run over edges that the picture does not show"""
    spill_price: float = 6.0
    """price of a region that does not lie on its surface at all, in proportion to what does not"""
    null_price: float = 3.5  # price of a primitive that is no part of the model
    relation_price: float = 3.5
    """what all relations of a primitive weigh together, as they repeat much the same information: with `null_price`,
    one that nothing confirms is no part of the model; 0 matches without relations"""
    tolerances: dict[str, Tolerance] = field(
        default_factory=lambda: {kind: replace(t, reach=FAR) for kind, t in TOLERANCES.items()}
    )
    """by kind of relation; places of arcs, unlike gaps, are as well known from afar"""
    covered_share: float = 0.5
    """share of its stretch of a model arc that another image arc may cover better before one is a second line beside"""
    nodes: int = 200  # of the search: what it has not proved by then it bounds


@dataclass(frozen=True)
class MatchingParameters:
    """Everything numeric that decides which primitives are which parts of a view."""

    view: ViewParameters = field(default_factory=ViewParameters)
    pose: PoseProblemParameters = field(default_factory=PoseProblemParameters)
