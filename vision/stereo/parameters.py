"""The parameters of stereo, a class a step: everything numeric that decides which arcs are matched.

On rendered metal true pairs differ by 0.05 rad and 0.25 in the median, by 0.2 rad and 0.8 at the 95th percentile, and
one in fifteen changes sign.  Between half and twice these values precision and recall move by a few hundredths.
"""

from dataclasses import dataclass, field


@dataclass(frozen=True)
class EpipolarParameters:
    """How crossings of rows are matched (Ohta and Kanade, PAMI 7, 1985)."""

    tangent_reach: int = 4
    """points to both sides whose chord is the tangent at a crossing"""
    least_rise: float = 0.2
    """sine of the angle to the rows below which a crossing says nothing of disparity"""
    angle_sigma: float = 0.25
    """rad: standard deviation of the difference of two matched crossings' angles"""
    contrast_scale: float = 8.0
    """grey: steps below this count little on the signed logarithmic scale of contrast"""
    contrast_sigma: float = 0.7
    """standard deviation of the difference of contrasts on that scale"""
    skip: float = 2.0
    """price of a crossing left unmatched"""
    layers: int = 2
    """how often what could not keep the order along a row is matched again; the second lifts the recall on random
    wireframes, where order means little, from .86 to .96"""


@dataclass(frozen=True)
class SegmentParameters:
    """How votes become pairs of arcs."""

    least_votes: int = 3
    """rows that a pair needs to be looked at"""
    null_cost: float = 0.7
    """price of an arc without partner, where a pair costs 1 - S; a pair below S = 1 - null_cost is never made"""


@dataclass(frozen=True)
class TriangulationParameters:
    """How sure the place of a matched arc is.

    Fitted to the true pairs of rendered metal: the lateral error of whole arcs, left less right, was 0.06 px in the
    median where the widths of the two arcs are alike to 0.03 px, 0.32 px where they differ by more than 0.2; what both
    pictures share of it (saturation, roundings) was 0.35 px.
    """

    common_sigma: float = 0.5
    """px: how far light shifts an arc as a whole in both pictures alike"""
    light_sigma: float = 0.07
    """px: how far light shifts an arc as a whole in one picture against the other, at equal widths"""
    width_share: float = 1.45
    """px of shift for each px by which the widths of the arc differ: unlike widths show unlike ends of a rounding"""
    local_sigma: float = 0.3
    """px: how far light shifts the end of an arc otherwise than the arc as a whole"""
    free_sigma: float = 0.8
    """px: the same of arcs that are free curves in a picture, or of unlike kinds: they may leave the fitted plane"""
    end_sigma: float = 2.0
    """px along an arc: how exactly its end is cut"""
    gradient_sigma: float = 0.5
    """standard deviation of the slopes of disparity, px a px, that arcs too straight to tell are held to"""
    tangent_reach: int = 8
    """points to both sides whose chord is the tangent at a crossing"""
    least_rise: float = 0.05
    """sine of the angle to the rows below which a crossing says nothing of disparity"""
    row_slack: float = 1.0
    """px beyond the rows of the right arc that the left one still counts as shown by both"""
    least_disparity: float = 0.1
    """px: what is farther off counts as this far"""
    ellipse_gain: float = 4.0
    """how much less than a circle's mean square distance an ellipse must have to be taken for one"""
    ellipse_share: float = 0.6
    """least share of an ellipse that must be seen; of less, every arc is the part of a circle"""
    roundest: float = 0.95
    """greatest ratio of the axes of an ellipse, on a plane that is known"""
    lean_sigmas: float = 3.0
    """by how many standard deviations of its plane's slope the ratio must lie below that"""


@dataclass(frozen=True)
class StereoParameters:
    """What a stereo match depends on besides arcs, rig and depths, a field a step."""

    epipolar: EpipolarParameters = field(default_factory=EpipolarParameters)
    segments: SegmentParameters = field(default_factory=SegmentParameters)
    triangulation: TriangulationParameters = field(default_factory=TriangulationParameters)


DEFAULTS = StereoParameters()
