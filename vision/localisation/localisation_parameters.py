"""The parameters of localisation that a run records: seeds, and what its verdict is told by.

Evidence is in natural logarithms of odds."""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class ElsewhereParameters:
    """Poses where the object is not, drawn about the best."""

    seed: int = 1975  # of the draws
    poses: int = 128  # poses drawn
    outlined: int = 16  # shifts by which the outlines are laid elsewhere
    near_px: float = 20.0  # px, rms, by which the image of what is seen moves at least, and the outlines
    far_px: float = 150.0  # px at most
    least_px_per_unit: float = 100.0
    """px for each radian, or shift by the distance, by which what moves the image less is taken to move it"""
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
    least_share: float = 0.25
    """share of the expected evidence below which it says nothing for a pose: 232 of the right part had .34 and more"""
    min_posterior: float = 0.95  # probability from which a pose is accepted
    max_absent_odds: float = 2.0
    """log odds that the object lacks edges of the model, beside what it is said to lack: more is another object"""
    max_absent_odds_anywhere: float = 3.0
    """the same of all edges, before it is known what has moved, at a pose found with no prior: many edges of a box lie
    on those of another"""
    max_features_odds: float = 3.0
    """log odds that features, as told, are another object's: 70 right poses had up to 2.6, wrong ones 3.1 and more"""
    max_faces_off: float = 1.8
    """standard deviations (rms) by which faces may lie off: 111 right poses had up to 1.76, other sizes up to 2.06"""
    temper: float = 0.05  # by which differences of evidence between rivals are multiplied
    agreement_px: float = 1.0  # px
    rival_share: float = 0.05  # share of the best pose's evidence by which a rival may fall short of it
    min_margin: float = 10.0  # evidence: likewise, at least
    most_told: int = 4  # poses that stand of which the account of edges is taken: more repeat each other
    rival_odds: float = 12.0
    """log odds of that account by which a rival may fall short: cells that repeat differ by 2, others by 37 and more"""
    prior_odds: float = 8.0  # log odds by the prior beyond which a pose is no rival: one in 3,000
    max_sigma: float = 6.0
    """sigmas from the prior beyond which a pose contradicts it: one in 5,000 errs by 5 in six dimensions"""
    max_apart_sigma: float = 4.73  # sigmas by which the cameras may disagree: more has one in 1,000 in six dimensions
    max_calibration_sigma: float = 3.5  # by which pictures may show a camera otherwise: more has one in 2,000
    named_standpoint_sigma: float = 2.6  # from which pictures show a standpoint elsewhere, and it is named: one in 110
    max_standpoint_sigma: float = 3.5  # beyond which the pose is refused: more has one in 2,000
    max_calibration_sigma_alone: float = 2.8
    """the same of a picture alone, of whose four numbers one in 50 lies off by more: no other picture contradicts it"""
    own_share: float = 0.01
    """share of the evidence by which it differs from pose to pose, since other samples of the model are seen"""
    least_camera_odds: float = -4.0
    """log odds, by the weights above, from which one camera of several sees the model: one in fifty.  Not fitted: see
    benchmarks/results/localisation.md for what cameras that see and blind ones have"""


@dataclass(frozen=True)
class LocalisationParameters:
    """What a localisation depends on besides pictures, model, rig and prior, a field a stage."""

    search_seed: int = 1989  # of the scrambled Sobol sequence that the scan of a prior follows
    refinement_seed: int = 1981  # of the draws of the consensus in a refinement
    elsewhere: ElsewhereParameters = field(default_factory=ElsewhereParameters)
    verdict: VerdictParameters = field(default_factory=VerdictParameters)


DEFAULTS = LocalisationParameters()
