"""What a feature is, its class and its form."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from relmodel.arrays import Floats
from relmodel.features.feature_parameters import DEFAULTS
from relmodel.model.content_keys import content_key, quantised

_ALL = DEFAULTS.common
LENGTH_TOLERANCE, ANGLE_TOLERANCE = _ALL.length_mm, _ALL.angle_rad


@dataclass
class Feature:
    """A feature in the frame of its shape.

    dimensions: name -> (value, unit: mm, rad, or 1 for counts), as `feature_dimension` holds them; shape_from_feature
    (4, 4): Z out of the material, X along the length; origin at the mouth of a hole, in the middle of a floor, at the
    foot of what stands out, in the middle of the rest; box (6,); surfaces: (surface_no, role); form: numbers that
    distinguish outlines of equal dimensions, mirror images included (`outline_form`).
    """

    kind: str
    name: str
    dimensions: dict[str, tuple[float, str]]
    shape_from_feature: Floats
    box: Floats
    surfaces: list[tuple[int, str]]
    form: tuple[float, ...] = ()


def feature_class_key(feature: Feature) -> str:
    """Key of a feature's class: kind, rounded dimensions and form."""
    dimensions = [
        f"{name}={value:.{_ALL.class_digits}f} {unit}" for name, (value, unit) in sorted(feature.dimensions.items())
    ]
    return content_key([feature.kind, *dimensions, *map(str, quantised(feature.form, _ALL.form_quantum).tolist())])


def outline_form(places: Floats, labels: list[str], pose: Floats, *, either_way: bool) -> tuple[float, ...]:
    """Moments of the places of walls along the Z of a frame, mm and mm2: a motion leaves them, a mirror changes them.

    places (n, 3): foot of the frame's origin on a plane, axis of a cylinder; labels: kinds of walls, by which they are
    weighted.  Odd moments distinguish skew outlines, even ones outlines that half a turn maps to themselves (see J.
    Flusser, "On the independence of rotation moment invariants", Pattern Recognition 33, 2000).  either_way: an outline
    that is open at both ends may be looked at from either.
    """
    local = (places - pose[:3, 3]) @ pose[:3, :2]
    z = local[:, 0] + 1j * local[:, 1]
    out: list[float] = []
    for label in sorted(set(labels)):
        own = z[[one == label for one in labels]]
        out += [float(len(own)), float(np.sum(np.abs(own)))]
    names = sorted(set(labels))
    weight = np.array([1.0 + names.index(label) for label in labels])
    reach = max(float(np.abs(z).max(initial=0.0)), LENGTH_TOLERANCE)
    for power in (1, 2):
        moments = [np.sum(weight * np.abs(z) ** k * z**power) / reach ** (k + power - 1) for k in range(3)]
        out += [float(abs(m)) for m in moments]
        twists = [float((a * np.conj(b)).imag) / reach for a, b in pairwise(moments)]
        out += [abs(t) for t in twists] if either_way else twists
    return tuple(out)


def lengths(**values: float) -> dict[str, tuple[float, str]]:
    """Dimensions in mm."""
    return {name: (float(value), "mm") for name, value in values.items()}


def commonest(values: list[float]) -> float:
    """The value that occurs most often, to the class's digits; the least of those that do."""
    rounded = [round(v, _ALL.class_digits) for v in values]
    return min(values, key=lambda v: (-rounded.count(round(v, _ALL.class_digits)), v))
