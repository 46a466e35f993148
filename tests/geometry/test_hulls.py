"""The points that lie farthest out, against the support of all points along many directions."""

import numpy as np
import pytest

from relmodel.arrays import Floats
from relmodel.geometry.transforms import outermost

COUNT = 30_000  # enough that most are left out before a hull is made


def ball() -> Floats:
    return np.random.default_rng(1).normal(size=(COUNT, 3)) * [300.0, 40.0, 2.0] + [900.0, -50.0, 7.0]


def plate() -> Floats:
    """A lattice that fills a plate: nearly all of its points lie in its faces."""
    x, y, z = np.meshgrid(np.linspace(-70.0, 430, 150), np.linspace(0.0, 120, 120), [0.0, 8.0])
    return np.stack([x, y, z], axis=-1).reshape(-1, 3)


def ring() -> Floats:
    """Both rims of a short cylinder, whose points are all corners, and what lies between them."""
    turn = np.linspace(0, 2 * np.pi, 900, endpoint=False)
    rims = [np.column_stack([50 * np.cos(turn), 50 * np.sin(turn), np.full(900, z)]) for z in (0.0, 5.0)]
    return np.concatenate([*rims, *(0.5 * (rims[0] + rims[1]) * s for s in (1.0, 0.9, 0.3))])


@pytest.mark.parametrize("points", [ball(), plate(), ring()], ids=["ball", "plate", "ring"])
def test_what_lies_farthest_out_is_kept(points: Floats) -> None:
    found = outermost(points)
    assert len(found) <= len(points) / 2
    assert {tuple(point) for point in found.tolist()} <= {tuple(point) for point in points.tolist()}
    directions = np.random.default_rng(2).normal(size=(300, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    reach = (points @ directions.T).max(axis=0)
    assert (found @ directions.T).max(axis=0) == pytest.approx(reach, abs=1e-11)
    # Along the axes to the bit: there boxes are compared with those of surfaces.
    assert np.array_equal(found.min(axis=0), points.min(axis=0))
    assert np.array_equal(found.max(axis=0), points.max(axis=0))


def test_of_flat_points_all_are_kept() -> None:
    flat = plate()[:COUNT] * [1.0, 1.0, 0.0]
    assert len(outermost(flat)) == len(flat)
    assert len(outermost(flat[:3])) == 3
