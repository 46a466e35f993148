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
class StereoParameters:
    """What a stereo match depends on besides arcs, rig and depths, a field a step."""

    light_sigma: float = 0.2
    """px: how far shading shifts an edge between the two pictures; on rendered metal half of the true pairs are off by
    more than 0.2 px in disparity, a fifth by more than 0.5, whatever their noise"""
    epipolar: EpipolarParameters = field(default_factory=EpipolarParameters)
    segments: SegmentParameters = field(default_factory=SegmentParameters)


DEFAULTS = StereoParameters()
