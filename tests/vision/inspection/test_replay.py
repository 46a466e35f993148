"""An inspection made again from what the store has of it: equal, until a row is altered."""

from __future__ import annotations

from typing import Any

import pytest
import sqlalchemy as sa

from relmodel.store import Store
from tests.app.cli.conftest import Inspection
from tests.given import CopyStore
from vision.inspection.replay import replay

ALTERED: dict[str, tuple[str, dict[str, Any] | None]] = {  # which row of a table, and what becomes of it
    "edge_measurement": ("view_no = 1 AND measurement_no = 7", {"sigma": sa.literal_column("sigma + 0.25")}),
    "threshold": ("name = 'states.least_px'", {"value": sa.literal_column("value + 1")}),
    "hypothesis": ("hypothesis_no = 0", None),
    "part_in_view": ("in_view_no = 0", {"path": "other"}),
}


def test_each_altered_row_is_told_and_no_other(blocks_seen: Inspection, copy_store: CopyStore) -> None:
    run = blocks_seen.answer["run"]
    with Store.open(copy_store(blocks_seen.store)) as store:
        with store.write() as connection:
            for name, (where, change) in ALTERED.items():
                table, row = store.table(name), sa.text(where)
                change_of = sa.delete(table) if change is None else sa.update(table).values(change)
                assert connection.execute(change_of.where(row, table.c.run_id == run)).rowcount == 1, name
        again = replay(store, run)
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
