"""One value altered, or one row deleted, of what an inspection wrote: somebody notices."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from benchmarks.alterations import alter, measure
from relmodel.store import Store
from relmodel.store.check import check
from tests.app.cli.conftest import Inspection
from tests.given import CopyStore


def test_alterations_are_noticed(inspection: Inspection, tmp_path: Path) -> None:
    found = measure(Path(inspection.store), inspection.answer["run"], 1, 3, tmp_path)
    assert [one for one in found if one.noticed_by == "nobody"] == []


def test_alterations_are_noticed_on_postgresql(postgresql_inspection: Inspection, copy_store: CopyStore) -> None:
    with Store.open(copy_store(postgresql_inspection.store)) as store:
        assert not any(finding.rows for finding in check(store))
        found = alter(store, postgresql_inspection.answer["run"], "unit_relation", np.random.default_rng(1))
        assert found.noticed_by != "nobody"


RELATION = "a relation is not what its candidates and tolerances give"
COMPATIBILITY = "a compatibility is not what the relations give"
TOLERANCE = "a tolerance is not what the parameters say"
OF_MATCHING = {
    """DELETE FROM compatibility WHERE problem_no = 1 AND NOT EXISTS (
        SELECT 1 FROM assignment AS a WHERE a.run_id = compatibility.run_id AND a.problem_no = compatibility.problem_no
            AND a.unit_no = unit_a AND a.label_no = label_a)""": {(1, COMPATIBILITY)},
    "UPDATE compatibility SET saves = saves + 1 WHERE problem_no = 0 AND unit_a % 5 = 0": {(0, COMPATIBILITY)},
    "UPDATE problem_tolerance SET nats = 3 * nats WHERE problem_no = 0": {
        (0, RELATION), (0, COMPATIBILITY), (0, TOLERANCE),
    },
    "UPDATE problem_tolerance SET distance = 3 * distance, angle = 3 * angle WHERE problem_no = 0": {
        (0, COMPATIBILITY), (0, TOLERANCE),
    },
    "DELETE FROM problem_tolerance WHERE problem_no = 2 AND kind = 'near'": {(2, RELATION), (2, COMPATIBILITY)},
    "UPDATE problem_relation SET weight = weight + 1 WHERE problem_no = 1 AND unit_no % 5 = 0": {
        (1, RELATION), (1, COMPATIBILITY),
    },
    "UPDATE problem SET nat_cost = 2 * nat_cost WHERE problem_no = 0": {
        (0, RELATION), (0, COMPATIBILITY), (0, "the weight of relations is not what the parameters say"),
    },
    "UPDATE candidate SET across = across + 1 WHERE problem_no = 2 AND unit_no % 5 = 0": {(2, COMPATIBILITY)},
    """UPDATE unit_relation SET distance = distance + 30 WHERE kind = 'bounds' AND unit_set_id = (
        SELECT labels_id FROM problem WHERE problem_no = 1)""": {(1, COMPATIBILITY)},
}  # fmt: skip


def test_what_matching_goes_by_is_worked_out_anew(inspection: Inspection, copy_store: CopyStore) -> None:
    """By the query that knows nothing of the digests of what was written."""
    with Store.open(copy_store(inspection.store)) as store:
        with store.read() as connection:
            assert store.rows(connection, "check/matching_rows") == []
        for change, expected in OF_MATCHING.items():
            with store.engine.connect() as connection:
                changed = connection.exec_driver_sql(change)
                found = {(row.problem_no, row.what) for row in store.rows(connection, "check/matching_rows")}
                connection.rollback()
            assert found == expected, (change, changed.rowcount)
