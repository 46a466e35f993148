"""What hollows are measured by, of surfaces that are stated."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any, cast

import numpy as np
import pytest

from relmodel.features.graph import Boundary
from relmodel.features.hollows import corner_radius

UP = np.array([0.0, 0, 1])


def cylinders(*stated: tuple[float, bool, float]) -> Boundary:
    """Radius, whether hollow, and degrees from upright; and a plane."""
    angle = np.radians([tilt for *_, tilt in stated] + [0.0])
    surfaces: dict[str, Any] = {
        "kind": np.array(["cylinder"] * len(stated) + ["plane"]),
        "radius": np.array([radius for radius, *_ in stated] + [9.0]),
        "concave": np.array([hollow for _, hollow, _ in stated] + [True]),
        "axis": np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1),
    }
    return cast(Boundary, SimpleNamespace(surfaces=SimpleNamespace(**surfaces)))


@pytest.mark.parametrize(
    ("stated", "radius"),
    [
        ([(3.0, True, 0.0), (3.0, True, 180.0), (5.0, True, 0.0)], 3.0),
        ([(5.0, False, 0.0), (5.0, False, 0.0), (3.0, True, 0.0)], 3.0),  # bosses' walls are no corners
        ([(5.0, True, 90.0), (5.0, True, 40.0), (3.0, True, 2.0)], 3.0),  # nor are fillets that lie
        ([(5.0, False, 0.0)], None),
    ],
)
def test_the_corner_radius_is_that_of_most_upright_hollow_rounds(
    stated: list[tuple[float, bool, float]], radius: float | None
) -> None:
    found = corner_radius(cylinders(*stated), list(range(len(stated) + 1)), UP)
    assert [it[0] if isinstance(it, tuple) else it for it in found.values()] == ([] if radius is None else [radius])
