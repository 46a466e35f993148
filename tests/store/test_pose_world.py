"""How sure a pose is in the world, against the closed form."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import sqlalchemy as sa
from scipy.spatial.transform import Rotation

from relmodel.arrays import Ragged
from relmodel.geometry.transforms import matrix_columns
from relmodel.store import Run, Store
from tests.poses import pose_of

Floats = npt.NDArray[np.float64]


def stored(store: Store, world_from_rig: Floats, covariance: Floats) -> dict[str, Any]:
    """The row of the view for a pose that is stored."""
    pose: dict[str, Any] = dict(matrix_columns(world_from_rig[None]))
    with Run.begin(store, "inspect", {}) as run, run.write() as connection:
        world, rig = (int(store.new_ids(connection, table, 1)[0]) for table in ("world", "rig"))
        run.append(connection, "world", {"id": [world], "name": str(run.id), "revision": 1, "content_key": "k"})
        run.append(connection, "rig", {"id": [rig], "content_key": str(run.id)})
        rest: dict[str, Any] = {
            "prior_covariance": Ragged.pack([np.eye(6).ravel()]),
            "covariance": Ragged.pack([covariance.ravel()]),
            "needs_translation_mm": 1.0,
            "needs_rotation": 0.01,
            "verdict": "accepted",
            "reason": "so",
            "posterior": 0.99,
        }
        run.append(connection, "inspection", {"run_id": [run.id], "world_id": world, "rig_id": rig, **pose, **rest})
    with store.read() as connection:
        rows = connection.execute(sa.text("SELECT * FROM pose_world WHERE run_id = :run"), {"run": run.id})
        return dict(rows.one()._mapping)


def sigmas(row: dict[str, Any]) -> list[float]:
    return [row[f"sigma_{axis}"] for axis in ("x", "y", "z", "rx", "ry", "rz")]


def test_the_spread_is_turned_as_the_rig_is(store_of_runs: Store) -> None:
    """What a pose is off by in the rig's frame, its shift and its turn, is seen turned by the rig in the world."""
    rng = np.random.default_rng(13)
    half = rng.normal(size=(6, 6)) * np.repeat([0.3, 1e-3], 3)[:, None]
    covariance = half @ half.T
    rotation = Rotation.random(random_state=rng).as_matrix()
    row = stored(store_of_runs, pose_of([1500.0, -300, 900], rotation), covariance)
    both = np.kron(np.eye(2), rotation)
    found, truth = np.reshape(row["covariance"], (6, 6)), both @ covariance @ both.T
    np.testing.assert_allclose(found, truth, rtol=1e-9, atol=1e-12)
    assert sigmas(row) == pytest.approx(np.sqrt(np.diag(truth)))
