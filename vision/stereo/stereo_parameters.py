"""The parameters of stereo, a class a step: everything numeric that decides which arcs are matched.

On rendered metal true pairs differ by 0.05 rad and 0.25 in the median, by 0.2 rad and 0.8 at the 95th percentile, and
one in fifteen changes sign.  Between half and twice these values precision and recall move by a few hundredths."""

from dataclasses import dataclass, field

from vision.relations.relations import TOLERANCES, Tolerance


@dataclass(frozen=True)
class EpipolarParameters:
    """How crossings of rows are matched (Ohta and Kanade, PAMI 7, 1985)."""

    tangent_reach: int = 4  # points to both sides whose chord is the tangent at a crossing
    least_rise: float = 0.2  # sine of the angle to the rows below which a crossing says nothing of disparity
    angle_sigma: float = 0.25  # rad: standard deviation of the difference of two matched crossings' angles
    contrast_scale: float = 8.0  # grey: steps below this count little on the signed logarithmic scale of contrast
    contrast_sigma: float = 0.7  # standard deviation of the difference of contrasts on that scale
    skip: float = 2.0  # price of a crossing left unmatched
    least_rows: int = 3  # rows that an arc must cross, and a pair share, to be matched by rows
    layers: int = 2
    """rounds of matching what could not keep the order along a row; the second lifts the recall on random wireframes,
    where order means little, from .86 to .96"""


@dataclass(frozen=True)
class RangeParameters:
    """How a pair shows by itself which disparities are to be looked at."""

    nearest_baselines: float = 1.0  # least depth that is searched, in baselines
    rounds: int = 2  # how often the range is narrowed about each place
    least_votes: int = 8  # rows that a pair of arcs needs to be trusted
    least_share: float = 0.5  # share of the longer arc's rows that a pair needs to be trusted
    ways: int = 3  # clusters of disparities, at most, that are looked into
    cluster_ratio: float = 1.4  # of the greatest to the middle disparity of a cluster
    widest_ratio: float = 2.0  # of the greatest to the middle disparity of the range, and of the middle to the least
    neighbours: int = 15  # trusted pairs that say what disparities there are about a place
    cut: float = 0.1  # share of the neighbours that is left out at both ends of the range
    margin: float = 25.0  # px by which the range is widened


@dataclass(frozen=True)
class EvidenceParameters:
    """What speaks against a pair of arcs, nats, and which pairs are priced at all.

    Prices: logistic regression on the candidates of seven rendered pairs (A0, A2, A4, A6, B0, C0, C2), second against
    wrong by the truth of rendering; on seven others they separate second from wrong with an area under the curve of
    .945."""

    most_unlike: float = 8.0  # squared sigmas of angle and contrast by which alike crossings may differ
    least_alike: float = 0.3  # share of the shorter arc's rows on which the two must be alike
    unvoted_of_shorter: float = 3.3  # nats for no vote of the shorter arc's rows
    unvoted_of_longer: float = 1.7  # nats for no vote of the longer arc's rows
    width: float = 1.3  # nats a px of difference of the widths
    end: float = 0.4  # nats a unit of log(1 + px) between the rows of the ends that agree better
    level_rows: float = 3.0  # px by which level arcs may lie on other rows, in addition to their heights
    level_contrast: float = 0.5  # nats a squared sigma of contrast, of level arcs; as the following
    level_length: float = 0.65  # nats a unit of the logarithm of the ratio of the lengths
    level_width: float = 1.7  # nats a px of difference of the widths
    level_end: float = 2.3  # nats a unit of log(1 + px) between the rows of the ends that agree better
    level_more: float = -0.3  # nats that level candidates start with, against others: they are second more often


@dataclass(frozen=True)
class RegionEvidenceParameters:
    """What speaks against a pair of regions, nats; found as the prices of arcs, area under the curve .960."""

    least_rows: float = 0.5  # share of the rows of both that a pair must have in common to be priced
    rows: float = 4.6  # nats for no common row
    area: float = 2.3  # nats a unit of the logarithm of the ratio of the areas
    mean: float = 0.03  # nats a grey level of difference of the means
    unvoted_of_fewer: float = 2.5
    """nats for no vote between the bounding arcs, against the votes of the region that has fewer"""
    unvoted_of_more: float = 1.5  # the same against the votes of the other


@dataclass(frozen=True)
class AssignmentParameters:
    """How prices and relations become labels."""

    scale: int = 8  # integer cost of a nat
    most_candidates: int = 8  # most labels of a unit that are kept, the cheapest, where they have a price
    arc_null: float = 2.1
    """nats for an arc without partner: on those seven pairs precision is .971 at a recall of .865; .977 at .837 with
    1.8, .965 at .890 with 2.6"""
    region_null: float = 2.5
    """nats for a region without partner: .954 at .728; .956 at .689 with 2, .941 at .795 with 3"""
    relation_share: float = 0.1
    """share of what a relation tells (`vision.relations.relations`) that counts in addition to prices: the relations
    of one unit repeat much the same information"""
    null_share: float = 0.7
    """share of the weight of its relations that a unit without partner pays: so much a partner may leave unconfirmed"""
    bare_relation_share: float = 0.25  # relation_share where nothing has a price
    bare_null_share: float = 0.7  # null_share where nothing has a price
    nodes: int = 20  # of the search, after which it ends with what it has proved


@dataclass(frozen=True)
class TriangulationParameters:
    """How sure the place of a matched arc is.

    Fitted to the true pairs of rendered metal: the lateral error of whole arcs, first less second, was 0.06 px in the
    median where the widths of the two arcs are alike to 0.03 px, 0.32 px where they differ by more than 0.2; what both
    pictures share of it (saturation, roundings) was 0.35 px."""

    common_sigma: float = 0.5  # px: how far light shifts an arc as a whole in both pictures alike
    light_sigma: float = 0.07
    """px: how far light shifts an arc as a whole in one picture against the other, at equal widths"""
    width_share: float = 1.45
    """px of shift for each px by which the widths of the arc differ: unlike widths show unlike ends of a rounding"""
    local_sigma: float = 0.3  # px: how far light shifts the end of an arc otherwise than the arc as a whole
    free_sigma: float = 0.8
    """px: the same of arcs that are free curves in a picture, or of unlike kinds: they may leave the fitted plane"""
    end_sigma: float = 2.0  # px along an arc: how exactly its end is cut
    gradient_sigma: float = 0.5
    """prior standard deviation of the slopes of disparity, px a px, for arcs too straight to determine them"""
    tangent_reach: int = 8  # points to both sides whose chord is the tangent at a crossing
    least_rise: float = 0.05  # sine of the angle to the rows below which a crossing says nothing of disparity
    row_slack: float = 1.0  # px beyond the rows of the second arc that the first still counts as shown by both
    least_disparity: float = 0.1  # px: what is farther off counts as this far
    point_sigma: float = 0.1  # px: how far a point of an arc lies off it, at least
    run_px: float = 5.0  # px along an arc within which its points are off alike
    edge_odds: float = -2.69
    """log odds of an edge of an object whose arcs are sure to 1 px, fitted with the next two to 1,882 matched arcs of
    14 rendered pairs: cross-validated, it ranks an edge above what is none 79 times in 100"""
    edge_of_sigma: float = -0.95  # what the log of the standard deviation (px) of an arc adds
    edge_of_width: float = -1.85  # what each px of an arc's width adds
    edge_width: float = 0.9  # px: beyond this
    ellipse_gain: float = 4.0
    """how many times smaller than a circle's an ellipse's mean square distance must be for the arc to be one"""
    ellipse_share: float = 0.6
    """least share of an ellipse that must be seen; of less, every arc is the part of a circle"""
    roundest: float = 0.95  # greatest ratio of the axes of an ellipse, on a plane that is known
    lean_sigmas: float = 3.0  # by how many standard deviations of its plane's slope the ratio must lie below that


@dataclass(frozen=True)
class StereoParameters:
    """All parameters of a stereo match: the method (`vision.stereo.match.METHODS`), the search
    (`relmodel.labelling.solve.MODES`), what relations tell, and a field a step."""

    method: str = "pong"
    search: str = "dual_ascent"
    tolerances: dict[str, Tolerance] = field(default_factory=lambda: dict(TOLERANCES))
    epipolar: EpipolarParameters = field(default_factory=EpipolarParameters)
    range: RangeParameters = field(default_factory=RangeParameters)
    evidence: EvidenceParameters = field(default_factory=EvidenceParameters)
    regions: RegionEvidenceParameters = field(default_factory=RegionEvidenceParameters)
    assignment: AssignmentParameters = field(default_factory=AssignmentParameters)
    triangulation: TriangulationParameters = field(default_factory=TriangulationParameters)


DEFAULTS = StereoParameters()
