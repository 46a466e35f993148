"""An inspection made again from what the store has of it: equal, until a row is altered."""

from __future__ import annotations

from typing import Any

import pytest
import sqlalchemy as sa

from tests.vision.inspection.conftest import Done
from vision.inspection.replay import replay

ALTERED: dict[str, tuple[str, dict[str, Any] | None]] = {  # which row of a table, and what becomes of it
    "edge_measurement": ("view_no = 1 AND measurement_no = 7", {"sigma": sa.literal_column("sigma + 0.25")}),
    "threshold": ("name = 'states.least_px'", {"value": sa.literal_column("value + 1")}),
    "hypothesis": ("hypothesis_no = 0", None),
    "part_in_view": ("in_view_no = 0", {"path": "other"}),
}


def test_each_altered_row_is_told_and_no_other(done: Done) -> None:
    store, answer = done
    kept = {}
    with store.write() as connection:
        for name, (where, change) in ALTERED.items():
            table, row = store.table(name), sa.text(where)
            kept[name] = connection.execute(sa.select(table).where(row)).one()._asdict()
            change_of = sa.delete(table) if change is None else sa.update(table).values(change)
            connection.execute(change_of.where(row))
    try:
        again = replay(store, answer.run)
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
    finally:
        with store.write() as connection:
            for name, (where, _) in ALTERED.items():
                connection.execute(sa.delete(store.table(name)).where(sa.text(where)))
                connection.execute(sa.insert(store.table(name)).values(kept[name]))
