"""The parameters of extraction, a class a stage: everything numeric that decides which rows an extraction gives.

Lengths in px of the picture, grey on 0..255, angles in rad; a standard deviation of the Gaussian facet is a "scale".
Values without a named source were chosen on rendered bulkheads (docs/extraction.md)."""

import json
from dataclasses import asdict, dataclass, field
from math import isfinite, pi, radians, sqrt
from typing import Any

from relmodel.errors import UsageError
from vision.relations.relations import RelationParameters


@dataclass(frozen=True)
class NoiseParameters:
    """How the noise curve of a picture is estimated."""

    bands: int = 16  # bands of grey, each with an estimate of its own
    min_samples: int = 300  # pixels that a band needs for that
    floor: float = 1.0 / sqrt(12.0)  # grey: least standard deviation, what rounding to whole grey levels leaves


@dataclass(frozen=True)
class EdgeParameters:
    """What counts as an edge element."""

    scale: float = 1.4  # px: standard deviation of the Gaussian facet
    min_contrast: float = 4.0  # grey: least height of a step
    significance: float = 1e-3  # level of the F-test of the gradient against the noise
    max_sigma: float = 0.5  # px: greatest predicted standard deviation of the position along the normal
    max_offset: float = 0.75  # px along the gradient from the pixel's centre: over half a pixel, so noise opens no gaps
    border: float = 2.5  # scales: further inside, the mirrored picture displaces no edge by more than 0.01 px
    max_spread: float = 4.0  # scales: what slopes less than the least step spread over so many is shading
    calibration_blur: float = 0.75  # px: blur of the step for which the bias of the offset is calibrated
    min_thin_cosine: float = 0.7  # cosine of the greatest angle of neighbours that see one crossing; one is kept
    kept_share: float = 0.03  # of the picture's range of grey: weaker elements that nothing links are not kept

    def __post_init__(self) -> None:
        if not 0.0 < self.significance <= 1.0:
            raise UsageError(f"a significance of {self.significance} is not a probability: give one of 0 to 1")


@dataclass(frozen=True)
class LinkingParameters:
    """How edge elements become chains, and chains are joined across gaps."""

    min_contrast: float = 12.0  # grey: weaker elements are not linked, so that an edge does not run on into texture
    min_elements: int = 5  # elements: shorter chains are dropped
    min_link_cosine: float = 0.8  # cosine of the greatest turn from one element to the next
    min_chord_cosine: float = 0.5  # cosine of the greatest angle of their chord to their mean tangent
    turn_price: float = 2.0  # px: what one less the cosine of the turn adds to the distance, for the cheapest link
    chord_price: float = 3.0  # px: what one less the cosine of the chord's angle adds
    fill_reach: float = 25.0  # px: longest gap that is bridged
    fill_angle: float = radians(35.0)  # rad: greatest angle of either tangent to the chord of a gap
    near_reach: float = 3.0  # px: gaps up to this are bridged without a step in the picture
    near_angle: float = pi / 3  # rad: angle to the chord that is allowed in these
    bend_price: float = 2.0  # px a rad: what the two angles add to the cost of a gap, as a share of its length
    min_loop_elements: int = 12  # elements: a chain closes on itself only from this length
    tangent_elements: int = 5  # elements at an end of a chain from which its tangent is taken
    min_support: float = 0.25  # share of the lesser contrast of the two chains that the picture must show along a gap
    support_distance: float = 2.0  # px to both sides of a gap at which the step is read
    support_samples: int = 9  # places along a gap at which it is read


@dataclass(frozen=True)
class SignificanceParameters:
    """Number of false alarms (Desolneux, Moisan and Morel, IJCV 40, 2000), for textured metal."""

    min_significance: float = -1.5  # minus log10 of the number of false alarms a megapixel: lesser arcs are dropped
    step_px: float = 4.0  # px from an edge at which its step is measured: a streak of texture has fallen back there
    cell: int = 48  # px: side of the cells in which steps are counted
    cells_around: int = 5  # cells across the surroundings of a cell
    stride: int = 6  # px between the pixels whose steps are counted
    orientations: int = 8  # classes of orientation modulo pi
    grades_per_octave: float = 3.5  # classes of the height of a step an octave
    elements_per_observation: float = 20.0  # elements that count as one after the first: the length of a streak
    mean_step: float = 16.0  # grey: mean of the exponential distribution of steps of metal, the least that is assumed
    tests: float = 1000.0  # chains tested a megapixel of brushed metal


@dataclass(frozen=True)
class SegmentationParameters:
    """How chains are cut into lines, circular, elliptic arcs and free curves at least description length."""

    line_price: float = 8.0  # nats: description length of a line, without half its chi-square
    circle_price: float = 11.0  # nats: of a circular arc
    curve_price: float = 20.0  # nats: of a free curve without its knots
    ellipse_price: float = 15.0  # nats: of an elliptic arc
    knot_spacings: tuple[float, ...] = (8.0, 16.0, 24.0)  # elements between knots of a free curve: cheapest taken
    knot_price: float = 3.0  # nats: of a knot, as much as the third parameter of a circular arc
    gap_price: float = 0.1  # nats a px of gap between two arcs that are joined
    min_elements: int = 5  # elements: shorter pieces are dropped
    min_sagitta: float = 0.8  # px: an arc that bows out by less is a line
    min_bow: float = 2.0  # standard deviations of an element: likewise
    min_rise: float = 7.0  # rms distances of its elements: likewise
    min_circle_elements: int = 8  # elements: shorter pieces are no circular arcs
    break_tolerance: float = 0.6  # px: tolerance of the candidate breaks (Douglas and Peucker)
    break_spacing: int = 24  # elements at most between two candidate breaks
    max_breaks: int = 64  # candidate breaks that a piece spans at most
    light_sigma: float = 0.25  # px: how far shading displaces parts of an edge from their common line
    min_reversed: float = 3.0  # independent elements: shorter lines join none whose bright side is the other
    min_ellipse_turn: float = 1.2  # rad: what turns less, by the circle through it, determines no ellipse
    min_slender_turn: float = 2.2  # rad: likewise by its tangents, where it includes the end of a slender ellipse
    min_aspect: float = 0.05  # minor over major axis: a narrower ellipse is two edges side by side
    corner_trim: int = 2  # elements next to a corner that are left out of the fit, since smoothing draws them inside
    corner_span: int = 4  # elements to both sides of a break between which a corner turns
    corner_angle: float = radians(25.0)  # rad: turn from which a break is a corner
    loop_span: int = 5  # elements to both sides over which a loop's straightest place is sought, to begin it there
    join_rounds: int = 4  # rounds of joining
    join_reach: float = 40.0  # px: longest gap between two arcs that are joined
    min_join_cosine: float = 0.5  # cosine of the greatest turn from the end of one to the start of the other
    join_overlap: float = 3.0  # px that two arcs may overlap
    join_ahead: float = 0.7  # share of a gap that must lie straight ahead
    max_ellipse_gap: float = 0.5  # share of the elements of both: longest gap in an ellipse
    max_joint_misfit: float = 2.0  # chi-square an element of what is joined


@dataclass(frozen=True)
class FittingParameters:
    """How arcs are fitted to their elements, and refined polylines measured along them."""

    model_sigma: float = 0.12  # px: how far a real edge strays from its curve beyond the noise
    unevenness: float = 3.0  # grey: how uneven surfaces beside an edge are; shifts it by that over its slope
    min_sagitta: float = 0.1  # px that a circular arc, trimmed at its corners, must still bow out by
    min_closed_turn: float = 0.7  # share of an ellipse that a closed arc runs round
    max_closed_gap: float = 0.15  # share of its length: greatest distance of the ends of a closed arc
    ellipse_rounds: int = 3  # rounds of the gradient-weighted fit of ellipses
    bias_rounds: int = 2  # rounds of correcting the elements of an ellipse for the bias of smoothing, and fitting again
    window: float = 5.0  # scales: standard deviation of the window along an arc over which its elements are averaged
    prior_freedom: float = 5.0  # degrees of freedom of the elements' own standard deviations, against their scatter
    knot_spacing: float = 8.0  # px between the knots of a free curve


@dataclass(frozen=True)
class JunctionParameters:
    """Where arcs meet."""

    reach: float = 8.0  # px that an end is prolonged
    overrun: float = 3.0  # px that it may have run beyond the junction
    max_overrun_share: float = 0.4  # share of its arc that it may have run beyond it
    end_sigma: float = 3.0  # px along an arc: where linking stopped says little of where the edge ends
    same: float = 1.5  # px: junctions nearer than this are one
    max_off: float = 0.6  # px: an arc that passes by farther, and farther than `max_off_sigmas`, has no part in it
    max_off_sigmas: float = 3.0  # standard deviations: likewise
    min_crossing_angle: float = radians(20.0)  # rad: an end that meets another arc at less runs along it
    min_straight_angle: float = radians(160.0)  # rad: two ways at more than this run on into each other
    support_distance: float = 1.5  # px to both sides of a prolongation at which grey is read
    blurred: float = 1.5  # px before the junction in which no step is required
    min_support: float = 0.25  # share of the arc's contrast that its prolongation must show
    rounds: int = 3  # rounds of leaving out what has no part in a junction
    min_sigma: float = 0.02  # px: least standard deviation across an arc
    tangent_points: int = 6  # points to an end, or to either side, that give a free curve its direction
    overrun_points: int = 6  # points, at most, that a refined polyline is cut back by at a junction


@dataclass(frozen=True)
class RegionParameters:
    """What edges enclose."""

    kind: str = "leak-proof"  # leak-proof, or plain: maximal connected sets of pixels that are no edge
    min_area: int = 40  # px: smaller regions merge, or belong to none
    balls: tuple[float, ...] = (12.0, 5.0, 2.0, 0.9)  # px: radii of the trapped balls (Zhang et al., 2009)
    max_step: float = 12.0  # grey: greatest step between the planes of regions that merge; half of it for large ones
    large: float = 6.0  # px: inradius from which a region stands by itself
    rounds: int = 3  # rounds of merging
    min_neck: float = 1.5  # inradii: open border across which large regions merge; a straight strip is two wide
    border_ends: float = 4.0  # px of edge that a border across a strip meets at its two ends
    max_edge_share: float = 0.1  # share of a border between large regions that may be edge
    min_open_share: float = 0.3  # share of a border that must be open for a fragment to merge across it
    border_reach: float = 10.0  # px that an end is prolonged to reach the border of the picture
    line_reach: float = 80.0  # px that a free end of a straight arc is prolonged to the next edge
    min_line_significance: float = -1.0  # significance from which it is
    edge_distance: float = 1.5  # px from an edge to where the adjacent region is read
    meeting: int = 6  # px within which another arc leaves an end no need to be prolonged
    loose_end_reach: int = 4  # px around the end of an edge within which a border counts as a gap in an edge
    saturation: float = 250.0  # grey from which a pixel is saturated

    def __post_init__(self) -> None:
        if self.kind not in ("leak-proof", "plain"):
            raise UsageError(f"there are no regions of kind {self.kind}: choose leak-proof or plain")


@dataclass(frozen=True)
class TopographyParameters:
    """The topographic primal sketch (Haralick, Watson and Laffey, IJRR 2, 1983), and arcs along ridges and ravines."""

    scale: float = 2.0  # px: scale of the facets
    min_slope: float = 0.5  # grey/px from which a facet slopes
    min_bend: float = 1.0  # grey/px^2 from which it is curved
    noise_sigmas: float = 3.0  # standard deviations of the noise: least slope and curvature likewise
    half_plane: float = 0.35  # rad: normals of ridges lie within a right angle of this; few ridges run across it
    min_height: float = 6.0  # grey: lower ridges give no arc
    min_elements: int = 20  # elements: shorter ridges give no arc


@dataclass(frozen=True)
class QualityParameters:
    """What speaks against an arc being an edge of the object: log odds by logistic regression on rendered bulkheads."""

    step_near: float = 3.1  # weight of the mean step `near` px off the arc over its contrast
    step_far: float = 9.2  # weight of that `far` px off it
    parallels: float = -2.7  # weight of the logarithm of the number of parallel elements around
    width: float = -2.2  # weight a px of blur
    offset: float = -7.7  # constant term of the log odds
    ridge_height: float = 3.3  # weight of the logarithm of a ridge's height
    ridge_parallels: float = -1.6  # weight of the logarithm of the number of parallel ridges around
    ridge_offset: float = -6.9  # constant term of the log odds
    near: float = 2.0  # px
    far: float = 4.0  # px
    cell: int = 8  # px: parallels are counted in 3 x 3 such cells; at most 15, so that counts fit in a byte
    orientations: int = 12  # classes of orientation modulo pi; neighbours count as parallel
    grades: int = 12  # classes of contrast, two an octave
    fainter: int = 3  # classes by which a parallel may be fainter
    highlight_distance: float = 3.0  # px from an edge to where its bright side is read
    saturation: float = 250.0  # grey from which it is a highlight
    min_recorded: float = 0.05  # lower values are recorded as 0


@dataclass(frozen=True)
class UnitParameters:
    """How arcs and regions become units of matching, and which share a border."""

    region_distance: float = 2.5  # px from an edge element at which the adjacent region is read
    min_border_share: float = 0.15  # share of an arc's elements that must see a region for the arc to bound it
    min_border_elements: int = 10  # or so many of them
    border_sigma: float = sqrt(2.0)  # px: of the length along which an arc bounds a region, from its two ends
    slant_sigma: float = 0.03  # share of the length of a border by which counting in four directions misjudges it
    end_sigma: float = 2.0  # px: of an end of an arc, where linking stopped
    outline_sigma: float = 1.0  # px: of the outline of a region, pixels shared out along an edge
    polyline_step: int = 4  # points of an arc's polyline of which one is kept: 4 px apart, off by .2 px at radius 10
    texture_doubt: float = 0.95
    """how doubtful all texture makes an arc (see `arc_quality`): of arcs along edges of seven rendered bulkheads one in
    ten has a texture above .5, of other arcs three in four"""
    doubt_power: float = 3.0  # power of what is left of 1 that an arc's length is multiplied by to give its salience


@dataclass(frozen=True)
class ExtractionParameters:
    """All parameters of an extraction, a field a stage.

    `mask`: SHA-256 of the region of interest, set by `extract`; empty where the whole picture is looked at."""

    noise: NoiseParameters = field(default_factory=NoiseParameters)
    edges: EdgeParameters = field(default_factory=EdgeParameters)
    linking: LinkingParameters = field(default_factory=LinkingParameters)
    significance: SignificanceParameters = field(default_factory=SignificanceParameters)
    segmentation: SegmentationParameters = field(default_factory=SegmentationParameters)
    fitting: FittingParameters = field(default_factory=FittingParameters)
    junctions: JunctionParameters = field(default_factory=JunctionParameters)
    regions: RegionParameters = field(default_factory=RegionParameters)
    topography: TopographyParameters = field(default_factory=TopographyParameters)
    quality: QualityParameters = field(default_factory=QualityParameters)
    units: UnitParameters = field(default_factory=UnitParameters)
    relations: RelationParameters = field(default_factory=RelationParameters)
    mask: str = ""

    def __post_init__(self) -> None:
        for name, value in _numbers(asdict(self)):
            if not isfinite(value):
                raise UsageError(f"the extraction's {name} is {value}: give a finite number")

    def to_json(self) -> str:
        """All parameters, defaults included, keys sorted."""
        return json.dumps(asdict(self), sort_keys=True)


def _numbers(parameters: Any, name: str = "") -> list[tuple[str, float]]:
    """Dotted names and values of the numbers in nested mappings and tuples."""
    if isinstance(parameters, dict):
        return [pair for key, value in parameters.items() for pair in _numbers(value, f"{name}.{key}".lstrip("."))]
    if isinstance(parameters, tuple):
        return [pair for value in parameters for pair in _numbers(value, name)]
    return [] if isinstance(parameters, str) else [(name, float(parameters))]
