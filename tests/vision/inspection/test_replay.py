"""An inspection made again from what the store has of it: equal, until a row is altered."""

from __future__ import annotations

import pytest
import sqlalchemy as sa

from tests.vision.inspection.conftest import Done
from vision.inspection.replay import replay

ALTERED = (
    ("edge_measurement", "UPDATE edge_measurement SET sigma = sigma + 0.25 WHERE view_no = 1 AND measurement_no = 7"),
    ("threshold", "UPDATE threshold SET value = value + 1 WHERE name = 'states.least_px'"),
    ("hypothesis", "DELETE FROM hypothesis WHERE hypothesis_no = (SELECT max(hypothesis_no) FROM hypothesis)"),
    ("part_in_view", "UPDATE part_in_view SET path = 'other' WHERE in_view_no = 0"),
)


def test_each_altered_row_is_told_and_no_other(done: Done) -> None:
    store, answer = done
    again = replay(store, answer.run)
    assert again.agrees
    assert again.others == []
    assert all(row.rows == row.again > 0 for row in again.outcomes)
    assert {"view_arc", "correspondence", "presence", "unit_relation", "search_pose"} <= {
        r.relation for r in again.outcomes
    }
    with store.read() as connection:
        kept = {name: connection.execute(sa.select(store.table(name))).all() for name, _ in ALTERED}
    for _, statement in ALTERED:
        with store.write() as connection:
            connection.exec_driver_sql(statement)
    try:
        found = {row.relation: row for row in replay(store, answer.run).outcomes if row.differing}
        assert set(found) == {name for name, _ in ALTERED}
        assert (found["edge_measurement"].differing, found["edge_measurement"].column) == (1, "sigma")
        assert found["edge_measurement"].difference == pytest.approx(0.25)
        assert (found["threshold"].differing, found["threshold"].column) == (1, "value")
        assert found["threshold"].difference == pytest.approx(1 / 31)  # of values above 1 as a share
        assert found["hypothesis"].again - found["hypothesis"].rows == found["hypothesis"].differing == 1
        assert (found["part_in_view"].column, found["part_in_view"].difference) == ("path", None)
    finally:
        with store.write() as connection:
            for name, rows in kept.items():
                connection.execute(sa.delete(store.table(name)))
                connection.execute(sa.insert(store.table(name)), [dict(row._mapping) for row in rows])
