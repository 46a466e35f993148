"""The parameters of the evidence for what is there, a class a stage."""

from dataclasses import dataclass, field
from math import cos, radians

from vision.account.account_parameters import AccountParameters


@dataclass(frozen=True)
class DisplacementParameters:
    """Where bodies lie by the elements beside their edges: surfaces, parts and assemblies alike."""

    reach_px: tuple[float, ...] = (5.0, 4.0, 3.0, 2.5, 2.5, 2.5)
    """px from the place tried within which elements count, a step of least squares each"""
    scale: float = 0.28  # scale of the robust loss (Geman and McClure), of the reach
    edge_px: float = 0.5  # px by which a stretch of an edge errs, one standard deviation: rounding, burr and response
    systematic_px: float = 0.27  # px by which all edges of a body may be drawn alike: the response is known no better
    rim_px: float = 0.06  # px by which a bore's rim is drawn aside otherwise than other bores', one standard deviation
    tolerance_px: tuple[float, ...] = (0.4, 1.2)  # px within which an edge drawn well, and one drawn roughly, is found
    drawn: tuple[float, ...] = (0.75, 0.25)  # shares of the edges that are drawn so
    hidden_px: float = 2.0  # px within which what belongs to an edge of another body hides one
    least_seen: float = 0.5  # share of an edge in sight at a displacement, clear of what belongs to others, to count
    least_mm: float = 0.75  # mm: edges cannot distinguish a smaller displacement from rounding and burr
    sure_sigma: float = 4.0  # standard deviations by which a displacement must differ from none


@dataclass(frozen=True)
class MovedParameters:
    """Displaced surfaces."""

    reach_mm: float = 15.0  # mm either way
    step_mm: float = 0.25  # mm between the displacements tried
    distinct_mm: float = 1.0  # mm by which two displacements are different ones
    tangent_cosine: float = 0.99  # of the angle within which surfaces meet smoothly: a corner moves with its walls
    least_left_mm: float = 1.0  # mm between two opposite faces, of material or room: no displacement leaves less
    min_px_per_mm: float = 0.15  # px by which an edge must move in the picture for each mm to count
    least_px: float = 0.8  # px: a smaller displacement is not clear of the edge's own place
    least_distinct_px: float = 40.0  # px of edges told from others, from which a displacement is sought and measured
    least_log_odds: float = 1.0  # log odds of moved against in place, for all the displacements tried
    rounds: int = 6  # rounds of weighing displacements again after some surfaces moved
    sure_log_odds: float = 3.0
    """log odds likewise, 20 to 1, from which it is said to have moved; below, it only explains edges of neighbours"""
    most_shaded: float = 0.9
    """share of its displaced edges that may have nothing but dark between both places: a foot has its shadow there"""
    most_mean_normal: float = 0.5  # length of the mean of the unit normals below which a surface bends around
    least_spread: float = 0.15  # mean square of the normals along the second direction that they span, there
    most_in_place: float = 0.5  # share of a surface's edges that may be found in place, if at the tolerance's limit
    clear_log_odds: float = 8.0  # log odds of moved from which more may: what lies there is others'
    crowded: float = 2.0  # by which a surface is known less where its edges lie too near to each other
    least_there: float = 0.6  # of a surface's edges that show, the share found where it is measured or has moved to


@dataclass(frozen=True)
class AppearanceParameters:
    """What features and surfaces look like, with them and without."""

    least_cells: float = 5.0
    """cells of the map of surfaces, clear of its border, from which a patch, or what is around one, says something"""
    least_rimmed: float = 0.7  # share of the edges around an opening that must be the hole's
    grey: float = 6.0  # grey levels, 0..255, by which patches of one thing differ, one standard deviation
    texture: float = 0.25  # the same of their texture, log of grey levels
    alike: float = 0.35  # by how much unit normals of faces differ that look alike, one standard deviation
    near_cells: float = 70.0  # cells at which another face counts half: light is uneven
    most_cells: float = 200.0  # cells from which another patch counts no more
    most_cells_behind: float = 30.0
    """cells as which what lies behind counts at most, where nothing is there, beside what is around"""
    usual_cells: float = 50.0  # cells of others that what anything looks like is worth
    usual_cells_behind: float = 10.0  # the same of what lies behind, which is alike everywhere
    unlike: float = 0.02  # share of the features that look like nothing else in the picture
    shaded: float = 0.5
    """share of the holes behind which lies the object's shadow, where what shows is as bright as elsewhere, or less"""
    least_bright: float = 0.4  # by which it is multiplied, at least
    like_around: float = 0.11  # share of the ribs, steps and slots that look as what is around them and not as others
    else_there: float = 0.3
    """share of the places without the feature where something else is than around: a plug, a patch"""
    most_cells_of_patch: float = 60.0  # cells from which a patch of a feature counts no more than others of it
    sure_cells: float = 30.0  # cells of a feature from which it speaks with all its weight
    most_log_odds: float = 5.0  # log odds of a patch at most
    share: float = 0.5  # by which log odds are multiplied: grey and texture of all patches err together
    share_of_faces: float = 0.35  # the same of what is not cut into what is around it or raised on it
    stopped_log_odds: float = 3.0
    """log odds against what lies behind, by all cameras, from which something else shows through a hole"""
    camera_log_odds: float = 0.5  # the same that each camera must have
    lit: float = 230.0  # mean grey around a hole from which light may fill it


@dataclass(frozen=True)
class PartParameters:
    """Displaced parts, each as one piece."""

    least_px: float = 60.0  # px of edges that a piece shows
    most_share: float = 0.3  # share of all edges in view from which the pose depends on the piece itself
    reach_mm: float = 6.0  # mm either way along both axes of its plane: where a piece is sought
    step_mm: float = 2.0  # mm between the places
    coarse: int = 30  # samples of a piece in a camera by which places are chosen
    best: int = 6  # places from which least squares start
    sigma: tuple[float, ...] = (5.0, 5.0, 0.3, radians(6.0))
    """standard deviations of where a piece lies: mm in its plane and out of it, rad about its normal"""
    least_log_odds: float = 4.0
    """log odds of there against in place, for all the places tried, and of turned against not"""
    sure_log_odds: float = 10.0  # log odds of its edges from which what a piece covers is not looked for
    turned_px: float = 700.0  # px of edges of a piece that is sought at any turn: bolts look alike at any turn
    turned_share: float = 0.35  # share of its edges found in place up to which it is
    max_cosine: float = cos(radians(20))  # cosine of the angle between two faces up to which their edge shows
    step_degrees: float = 5.0  # degrees between turns


@dataclass(frozen=True)
class DistanceParameters:
    """Distances between the axes of holes and bosses."""

    neighbours: int = 3  # nearest ones of each to which distances are measured
    min_cosine: float = cos(radians(0.5))  # cosine of the angle up to which axes are parallel
    same_level_mm: float = 10.0  # mm along the axes within which two are in one plane
    least_mm: float = 1.0  # mm: what is nearer has the same axis
    changed_sigma: float = 5.0  # standard deviations by which a distance must differ to count as changed
    changed_mm: float = 0.8  # mm likewise


@dataclass(frozen=True)
class StateParameters:
    """From evidence to states."""

    least_px: float = 30.0  # px of edges that can be distinguished from others, below which nothing is decided
    least_log_odds: float = 3.0  # log odds, either way, from which a state is more than undecided: 20 to 1
    least_expected: float = 2.0  # log odds expected of what is there, below which missing edges say nothing
    contradicted_log_odds: float = 7.0  # log odds from which another thing must be there: 1000 to 1
    contradicted_within: float = 5.0
    """the same of a hole, a boss, a rib or the like that shows nothing of its edges: of 1983 such that are there none
    is told so, and one lies within 1 of the limit"""
    contradicted_by_share: float = 16.0  # more of these by the share of its edges that is found all the same
    most_share: float = 0.3  # share of all edges in view from which a part is what the pose depends on
    least_moved_share: float = 0.05  # share of an item's edges that a surface must have to speak for it
    changed_sigma: float = 4.0
    """standard deviations by which a thickness must differ, or a bore lie aside, to count as changed; a diameter that
    differs by so many has changed by whatever it is: of 253 that are as modelled one differs by 3.6, none by more"""
    changed_diameter_sigma: float = 3.5  # the same of a diameter, with `changed_mm`
    changed_mm: float = 0.8  # mm likewise: smaller differences are within the error of small bores and burrs
    doubtful_sigma: float = 3.0  # standard deviations from which a diameter or a thickness is doubtful
    most_sigma_mm: float = 0.5  # mm: standard deviation above which a diameter is hardly known, twice that of an offset
    most_sigma: float = 0.05  # the same as a share of the diameter: the greater of both counts
    changed_wall_mm: float = 1.5  # mm likewise of a thickness: both of its sides err


@dataclass(frozen=True)
class UnexplainedParameters:
    """Which arcs and regions of a picture form something that the model does not account for."""

    reach_px: float = 4.0  # px within which a predicted edge or blend accounts for an element
    min_cosine: float = cos(radians(25))  # cosine of the angle between the two, at least
    most_explained: float = 0.2  # share of an arc's elements that may be accounted for
    least_px: float = 50.0  # px of length of an arc that ends
    least_closed_px: float = 30.0
    """px of length of one that closes, which chance seldom does, and of what is unexplained around a region"""
    most_texture: float = 0.25  # probability that it is brush texture or shading, at most
    most_highlight: float = 0.5  # share of it along saturated grey, at most
    least_contrast: float = 3.0  # times the median contrast of the picture's elements, at least
    clear_share: float = 0.2  # share of the picture's range of grey from which a contrast is clear in any case
    least_border: float = 0.6
    """share of a region's border that must run along arcs, and of that along unexplained ones: of 4400 regions in 26
    pictures with the right model none passes, and a bolt, a lug or a hole more does in most pictures"""
    least_area_px: float = 60.0  # px of a region: smaller ones are burrs and ends of shadows
    rim_px: float = 5.0  # px from the picture's border where a region's border is not looked at: extraction ends there


@dataclass(frozen=True)
class PresenceParameters:
    """All parameters of the evidence, a field a stage."""

    account: AccountParameters = field(default_factory=AccountParameters)
    displacement: DisplacementParameters = field(default_factory=DisplacementParameters)
    moved: MovedParameters = field(default_factory=MovedParameters)
    appearance: AppearanceParameters = field(default_factory=AppearanceParameters)
    parts: PartParameters = field(default_factory=PartParameters)
    distances: DistanceParameters = field(default_factory=DistanceParameters)
    states: StateParameters = field(default_factory=StateParameters)
    unexplained: UnexplainedParameters = field(default_factory=UnexplainedParameters)


DEFAULTS = PresenceParameters()
