"""The parameters of localisation, a class a stage: everything numeric that decides what pose and verdict come out.

Pixels are those of the camera without distortion, lengths mm, angles rad, evidence in natural logarithms of odds.
Values without a named source were chosen on rendered bulkheads with exact truth.
"""

from dataclasses import dataclass, field
from math import radians


@dataclass(frozen=True)
class VisibilityParameters:
    """What counts as seen, and how a view's arcs are put together."""

    ray_offset_mm: float = 0.1
    """mm off the surface at which a ray starts; at a tessellation of 0.05 mm this agrees with exact hidden lines"""
    smooth_angle: float = radians(20)
    """rad: faces that meet at less are smoothly joined: a blend, which shows as shading and not as an edge"""
    bridged_samples: int = 3  # samples: shorter hidden stretches do not break a visible run of an arc, since rays graze
    coverage_step_px: int = 3
    """px: side of the square that a ray stands for; shares of parts that cover 400 px are good to about 5 %"""
    coverage_near_mm: float = 1.0  # mm before the camera: triangles that reach nearer are tested against every ray


@dataclass(frozen=True)
class EvidenceParameters:
    """Edge evidence of a picture: log likelihood ratio against what chance finds (Desolneux, Moisan and Morel)."""

    orientations: int = 16  # classes of orientation modulo pi
    strengths: tuple[float, ...] = (0.03, 0.12, 0.3)  # classes of contrast, as shares of the picture's range of grey
    detection: tuple[float, ...] = (0.75, 0.5, 0.2)
    """share of the visible sharp edges of machined parts that show at least that contrast"""
    surroundings_px: float = 96.0  # px: half side of the window in which chance is counted
    background_cells: float = 40.0  # cells: weight of the whole picture's share in it
    block_px: float = 16.0  # px: side of the blocks in which it is counted
    border_px: float = 6.0  # px along the picture's border in which no edge can be found
    min_grey_range: float = 16.0  # grey: least range that contrasts are related to


@dataclass(frozen=True)
class SearchParameters:
    """The scan of the prior's volume on coarse evidence and the climb on finer."""

    seed: int = 1989  # of the scrambled Sobol sequence
    correlation_px: float = 40.0  # px along an arc that count as one observation: closer samples see the same picture
    sample_spacing_px: float = 4.0  # px between the samples that are kept for the search
    select_sigma: float = 6.0  # sigmas of image shift beyond the pictures within which arcs are kept
    select_px: float = 60.0  # px beyond the pictures within which arcs are kept about poses that need no search
    least_share: float = 0.5  # share of the best start's score from which others climb too, where the join gives starts
    scan_sigma: float = 2.5  # sigmas of image shift beyond the pictures within which they are predicted for the scan
    scan_samples: int = 800  # samples that face a camera
    scan_cell_px: float = 4.0  # px: cells of the coarse evidence
    scan_reach_px: float = 6.0  # px that a prediction may be off there
    scan_window: int = 10  # cells: greatest common shift of a picture either way
    scan_step: int = 2  # cells between shifts
    scan_poses: int = 1024
    """poses of the sequence for a prior that leaves `scan_spread_px` beside common shifts; as its square for others"""
    scan_spread_px: float = 15.0  # px, rms
    max_scan_poses: int = 16384  # poses at most
    scan_distinct_px: float = 6.0  # px, rms over the samples, by which poses differ that go on to the climb
    scan_kept: int = 100  # poses that do
    climb_cell_px: float = 2.0  # px: cells of the fine evidence
    climb_reach_px: float = 3.0  # px that a prediction may be off there
    climb_first_px: float = 4.0  # px: first step of the climb
    climb_last_px: float = 1.0  # px: last step
    climb_distinct_px: float = 3.0  # px, rms over the samples, by which the candidates differ
    climb_kept: int = 24  # candidates at most


@dataclass(frozen=True)
class RivalParameters:
    """Which poses are followed up beside the best: other candidates, and shifts by what repeats in the model."""

    same_px: float = 1.5  # px, rms over what is seen, within which two poses are one
    min_candidate_share: float = 0.3  # share of the best candidate's score from which others are followed up
    candidates: int = 6  # candidates beside the best that need no more than that
    min_equal_share: float = 0.94
    """the same share of the others: they are followed up where the pictures may not tell them from the best"""
    min_evidence_share: float = 0.7  # share of the best evidence to which a pose must climb to be refined
    samples: int = 1200  # samples of that climb
    first_px: float = 2.0  # px: its first step
    last_px: float = 0.5  # px: its last step
    prior_weight: float = 0.01  # weight of the prior in it
    rounds: int = 3  # rounds of shifting the best pose, which may change
    leading_share: float = 0.5
    """share of what is known of the best pose in some direction that an arc holds, from which it is left out on
    trial"""
    leading_arcs: int = 8  # such arcs at most
    max_refined: int = 60  # hypotheses at most; the likeliest by the prior are followed first
    congruent: float = 0.02  # share to which length and second moments of the tangents of congruent arcs agree
    box_mm: float = 2.0  # mm: boxes in which displacements of congruent arcs are gathered
    min_visible_share: float = 0.25  # share of the visible length that a displacement must carry onto congruent arcs
    displacements: int = 12  # displacements at most


@dataclass(frozen=True)
class SymmetryParameters:
    """When a motion carries the model onto itself."""

    sharp_rad: float = radians(5.0)  # rad between the faces of an edge, at least, that counts
    few: int = 600  # samples of edges on which a motion is fitted
    reaches_mm: tuple[float, ...] = (8.0, 3.0, 1.0, 0.5)
    """mm between a moved sample and an edge in each step of the fit, beyond the stretch that a sample stands for"""
    least_share: float = 0.7  # share of these samples that lie on edges in each step; else there is no symmetry
    tolerance_mm: float = 0.25  # mm by which any sample may be off its edge at last: less than pictures tell
    alike_mm: float = 20.0
    """mm that edges at right angles are apart beside their distance, where the nearest is looked for"""
    parallel: float = 0.97  # cosine of the directions of a moved edge and the one it lies on, at least
    most: int = 60  # motions of a group at most
    same: float = 0.05  # by which numbers of two matrices (mm for shifts) differ if they are one motion


@dataclass(frozen=True)
class RefinementParameters:
    """Least squares of predicted arcs on edge elements."""

    rounds: tuple[tuple[float, float], ...] = ((9.0, 4.0), (6.0, 2.0), (4.0, 1.0), (3.0, 0.7))
    """(px, px): reach along the normal and scale of the robust loss (Geman and McClure) of each round"""
    near_rounds: int = 2
    """last rounds, which are also tried without the others: the wide ones may be led off a right start by edges printed
    beside"""
    least_gain: float = 3.0  # log odds by which the start, or the pose of the near rounds, must do better to be kept
    steps: int = 6  # Gauss-Newton steps at most in a round
    min_step_sigma: float = 0.05  # sigmas: a shorter step ends a round
    max_last_step_sigma: float = 2.0
    """sigmas of a step beyond which the last one, on what was measured at the pose, is not taken: others are of some
    hundredths to tenths, in small pictures up to one"""
    samples: int = 3000  # samples that face a camera
    min_cosine: float = 0.94  # cosine of the greatest angle between a predicted arc and an edge element
    max_along_px: float = 0.75  # px along the arc between a sample and the edge element on its normal
    partner_odds: float = 1.1
    """log likelihood ratio of an edge of the object, against anything else, that a partner in stereo gives an arc:
    measured on 14 rendered pairs, where .57 of the arcs along visible edges have one and .19 of others"""
    no_partner_odds: float = -0.63  # the same of having none
    seed: int = 1981  # of the draws of the consensus (Fischler and Bolles, 1981)
    draws: int = 300  # draws
    drawn_arcs: int = 5  # arcs in a draw
    consensus_px: float = 1.5  # px within which a measurement agrees with a draw
    max_shift_sigma: float = 2.0
    """sigmas of the pose without a part by which that part may shift it; one in its place that determines the
    pose as well as all others together shifts it by less in 98 of 100 cases"""
    max_joint_shift_sigma: float = 3.0
    """sigmas of the pose with the part, likewise: in six dimensions 17 in 100 of two equal halves lie further
    apart"""
    max_left_out: float = 0.8
    """share of the edges found up to which a part that knows more than the others is suspected: without one that
    holds more, too little evidence is left against it"""
    max_prior_share: float = 0.8
    """share of the prior's variance, in the direction where most is left, from which a pose counts as undetermined"""
    temper: float = 0.2  # by which differences of evidence are multiplied, for neighbouring edges err together
    suspect_sigma: float = 0.5
    """sigmas to first order from which a part is left out on trial: robust weights hide most of a shift"""
    most_tolerance: float = 2.5  # sigmas of an arc's tolerance within which it is looked for
    systematic_px: float = 0.08  # px: what an edge's own sigma leaves out: tessellation, rounded and burred edges
    texture_px: float = 0.5
    """px: by how much texture displaces an edge of its own contrast; less in proportion to the contrast"""
    response_px: float = 0.25
    """px at a contrast of the whole range of grey: how far a camera's response moves edges toward their dark side"""
    response_sigma_px: float = 0.25  # px: standard deviation of that, an unknown of each camera
    calibration_px: float = 0.02  # px: standard deviation of each camera's principal point, two unknowns
    convention_px: float = 0.3
    """px: standard deviation by which all principal points are off alike, of a rig that does not say how well it is
    known: half a pixel where two programs count pixel centres differently"""
    arc_shift_px: float = 0.06
    """px: usual standard deviation by which an arc's image is shifted as a whole, where all of its edges are found; the
    more in proportion, the fewer are"""
    least_found: float = 0.05  # share of an arc's edges as which fewer count, for that
    usual_arcs: float = 4.0  # arcs as which this usual value counts


@dataclass(frozen=True)
class SupportParameters:
    """What a pose gathers of the pictures' evidence."""

    offset_px: float = 0.4  # px: standard deviation of edges about the arcs they belong to, beyond their own
    stray_share: float = 0.3  # share of the edges found beside an arc that shows that are not its own
    shown_shares: tuple[float, ...] = (0.2, 0.35, 0.5, 0.65, 0.8, 0.95)
    """shares of the arcs that show, as likely one as another before a picture is seen"""
    displaced_px: float = 12.0  # px by which the image of a part may be shifted that is not where the model says
    turned: float = 0.02  # rad, and share: standard deviation by which such an image is turned and scaled
    displaced_cost: float = 5.0
    """evidence that such a shift costs in each camera: the logarithm of how many places are distinguished"""


@dataclass(frozen=True)
class OutlineParameters:
    """Greys on both sides of the model's outline.  Chosen on printed boxes and small objects rendered, of which right
    poses reach 1.2 to 3, and poses 4 mm and a degree off seldom 1."""

    step_px: int = 3  # px: side of the squares that are looked at
    near_px: float = 3.0  # px from the outline: nearer pixels mix both sides
    far_px: float = 6.0  # px from the outline: pixels up to there are classified inside or outside, by those beyond
    window_px: float = 24.0  # px: half side of the window whose pixels are inside or outside for sure
    min_cells: float = 8.0  # squares of each that must be there
    noise_grey: float = 4.0  # grey: least standard deviation of either: noise, and what the model leaves out of it
    most: float = 3.0  # log likelihood ratio at most that a pixel counts
    observed_px: float = 120.0
    """px of outline that count as one observation: a side that has the grey of what lies behind it errs as a whole"""


@dataclass(frozen=True)
class ElsewhereParameters:
    """Poses where the object is not, drawn about the best."""

    seed: int = 1975  # of the draws
    poses: int = 128  # poses drawn
    outlined: int = 16  # shifts by which the outlines are laid elsewhere
    near_px: float = 20.0  # px, rms, by which the image of what is seen moves at least, and the outlines
    far_px: float = 150.0  # px at most
    least_px_per_unit: float = 100.0
    """px for each radian, or for each shift by the distance: a direction that moves the image less is taken to move it
    so much"""
    share: float = 0.25  # share of the poses by whose evidence the rest of the distribution is told
    least_scale: float = 1.0
    """log odds by which these exceed it in the mean, at least: chance is never less than that of independent places"""


@dataclass(frozen=True)
class VerdictParameters:
    """When a pose is accepted, ambiguous or refused."""

    offset: float = -12.6
    """log odds of a pose whose statistics are all zero; fitted, as `weights`, by benchmarks/verdict.py"""
    weights: tuple[float, ...] = (0.26, 6.4, 9.5, 0.22)
    """log odds for each unit of: rarity of the evidence elsewhere, share, agreement, nearness to the prior"""
    searched_rarity: float = 12.0
    """rarity that the best of all poses of a search has by chance; less says nothing for a pose"""
    most_rarity: float = 30.0  # rarity beyond which more says no more
    most_share: float = 1.0  # share of the expected evidence beyond which more evidence counts no more
    min_posterior: float = 0.95  # probability from which a pose is accepted
    least_share_anywhere: float = 0.6
    """share of the expected evidence that a pose found with no prior has to show: weights and chance are of poses near
    one, and of a box much lies on the edges of another"""
    temper: float = 0.05  # by which differences of evidence between rivals are multiplied
    agreement_px: float = 1.0  # px
    rival_share: float = 0.05  # share of the best pose's evidence by which a rival may fall short of it
    min_margin: float = 10.0  # evidence: likewise, at least
    most_related: int = 4
    """poses that stand up to which relational matching is asked which of them it is: more repeat each other"""
    prior_odds: float = 8.0  # log odds by the prior beyond which a pose is no rival: one in 3,000
    max_sigma: float = 6.0
    """sigmas from the prior beyond which a pose contradicts it: one in 5,000 errs by 5 in six dimensions"""
    max_apart_sigma: float = 4.73  # sigmas by which the cameras may disagree: more has one in 1,000 in six dimensions
    own_share: float = 0.01
    """share of the evidence by which it differs from pose to pose, since other samples of the model are seen"""
    least_camera_odds: float = -4.0
    """log odds, by the weights above, from which one camera of several sees the model: one in fifty.  Not fitted: see
    docs/localisation.md for what cameras that see and blind ones have"""


@dataclass(frozen=True)
class LocalisationParameters:
    """What a localisation depends on besides pictures, model, rig and prior, a field a stage."""

    visibility: VisibilityParameters = field(default_factory=VisibilityParameters)
    evidence: EvidenceParameters = field(default_factory=EvidenceParameters)
    search: SearchParameters = field(default_factory=SearchParameters)
    rivals: RivalParameters = field(default_factory=RivalParameters)
    symmetry: SymmetryParameters = field(default_factory=SymmetryParameters)
    refinement: RefinementParameters = field(default_factory=RefinementParameters)
    support: SupportParameters = field(default_factory=SupportParameters)
    outlines: OutlineParameters = field(default_factory=OutlineParameters)
    elsewhere: ElsewhereParameters = field(default_factory=ElsewhereParameters)
    verdict: VerdictParameters = field(default_factory=VerdictParameters)


DEFAULTS = LocalisationParameters()
