"""The parameters of the evidence for what is there, a class a stage."""

from dataclasses import dataclass, field
from math import cos, radians


@dataclass(frozen=True)
class SampleParameters:
    """Which edge elements are looked at beside predicted edges."""

    reach_px: float = 28.0
    """px along the normal: how far an edge may have moved to be found again"""
    min_cosine: float = cos(radians(18))
    """cosine of the greatest angle between an element's normal and the predicted one"""
    max_beside_px: float = 0.75
    """px along the edge: an edge has one element a row or column, so that one lies within this of any normal"""


@dataclass(frozen=True)
class PresenceParameters:
    """What the evidence depends on besides pictures, model and pose, a field a stage."""

    samples: SampleParameters = field(default_factory=SampleParameters)


DEFAULTS = PresenceParameters()
