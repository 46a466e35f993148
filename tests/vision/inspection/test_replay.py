"""An inspection of blocks made again from what the store has of it: equal, until a row is altered."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.arrays import Floats
from relmodel.store import Store
from tests.app.cli.conftest import Inspection
from tests.given import CopyStore
from vision.inspection.replay import Replay, replay
from vision.presence.states import assess

ALTERED: dict[str, tuple[str, dict[str, Any] | None]] = {  # which row of a table, and what becomes of it
    "edge_measurement": ("view_no = 1 AND measurement_no = 7", {"sigma": sa.literal_column("sigma + 0.25")}),
    "threshold": ("name = 'states.least_px'", {"value": sa.literal_column("value + 1")}),
    "hypothesis": ("hypothesis_no = 0", None),
    "part_in_view": ("in_view_no = 0", {"path": "other"}),
}


Sigmas = list[Floats]


@pytest.fixture(scope="module")
def made_again(blocks_seen: Inspection, copy_store: CopyStore) -> tuple[Replay, Sigmas]:
    """Of altered rows; and how well sizes are known, by a camera whose response is said to move edges a pixel to the
    bright side, and as it was."""
    run, sigmas = blocks_seen.answer["run"], list[Floats]()

    def assess_in_both_lights(stored: Any, seen: Any, found: Any, *given: Any) -> Any:
        unknowns = found.best.camera_unknowns.copy()
        unknowns[:, 0] = -1.0
        for light in (replace(found, best=replace(found.best, camera_unknowns=unknowns)), found):
            presence = assess(stored, seen, light, *given)
            sigmas.append(presence.signs.surfaces.sigma)
        return presence

    with Store.open(copy_store(blocks_seen.store)) as store, pytest.MonkeyPatch.context() as patch:
        patch.setattr("vision.inspection.inspection.assess", assess_in_both_lights)
        with store.write() as connection:
            for name, (where, change) in ALTERED.items():
                table, row = store.table(name), sa.text(where)
                change_of = sa.delete(table) if change is None else sa.update(table).values(change)
                assert connection.execute(change_of.where(row, table.c.run_id == run)).rowcount == 1, name
        return replay(store, run), sigmas


def test_each_altered_row_is_told_and_no_other(made_again: tuple[Replay, Sigmas]) -> None:
    again, _ = made_again
    assert (again.agrees, again.others) == (False, [])
    same, found = ({it.relation: it for it in again.outcomes if bool(it.differing) == d} for d in (False, True))
    assert all(row.rows == row.again > 0 for row in same.values())
    assert {"view_arc", "correspondence", "presence", "unit_relation", "search_pose"} < set(same)
    assert set(found) == set(ALTERED)
    assert (found["edge_measurement"].differing, found["edge_measurement"].column) == (1, "sigma")
    assert found["edge_measurement"].difference == pytest.approx(0.25)
    assert (found["threshold"].differing, found["threshold"].column) == (1, "value")
    assert found["threshold"].difference == pytest.approx(1 / 31)  # of values above 1 as a share
    assert found["hypothesis"].again - found["hypothesis"].rows == found["hypothesis"].differing == 1
    assert (found["part_in_view"].column, found["part_in_view"].difference) == ("path", None)


def test_sizes_err_by_what_was_solved_toward_the_bright_side(made_again: tuple[Replay, Sigmas]) -> None:
    """No size is known better than by that pixel."""
    lit, usual = made_again[1]
    known = np.isfinite(usual) & np.isfinite(lit)
    assert known.sum() > 3
    px = 350 / 520  # at least that many a mm
    assert (np.hypot(usual, 0.5 / px)[known] < lit[known]).all()


def test_cameras_that_see_the_same_and_state_their_sigma_need_no_note(blocks_seen: Inspection) -> None:
    assert not any("lies in the other's" in note or "were calibrated" in note for note in blocks_seen.kept.notes)
