"""A stereo match in the store, and its cost recomputed there."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from relmodel.store.runs import Run
from relmodel.store.store import Store
from tests.labelling.oracle import add_unit_set
from tests.vision.stereo.scenes import parallel_rig, picture_of, random_pair
from vision.stereo.match import StereoMatches, match_pictures, record_stereo

PROBLEM = 3


@pytest.fixture(scope="module")
def found() -> StereoMatches:
    left, right, _ = random_pair(0)
    return match_pictures(parallel_rig(), picture_of(left), picture_of(right))


@pytest.fixture(scope="module")
def recorded(new_store: Callable[[str], str], found: StereoMatches) -> Iterator[tuple[Store, int]]:
    with Store.open(new_store("duckdb")) as store:
        with Run.begin(store, "inspect", {}) as run, run.write() as connection:
            for n, count in ((1, found.arcs[0]), (2, found.arcs[1])):
                add_unit_set(run, connection, n)
                arcs = np.arange(count)
                run.append(connection, "unit", {"unit_set_id": n, "unit_no": arcs, "kind": "arc", "ref_no": arcs})
            record_stereo(run, connection, PROBLEM, 1, 2, found)
        yield store, run.id


def test_rows_say_what_was_found(recorded: tuple[Store, int], found: StereoMatches) -> None:
    """And the assignment holds by them."""
    store, run_id = recorded
    tables = {}
    with store.read() as connection:
        assert [row for check in ("cost", "bound") for row in store.rows(connection, f"check/matching_{check}")] == []
        for name in ("assignment", "candidate", "triangulated_unit"):
            table = store.table(name)
            tables[name] = connection.execute(table.select().where(table.c.run_id == run_id)).mappings().all()
    label = {r["unit_no"]: -1 if r["label_no"] is None else r["label_no"] for r in tables["assignment"]}
    assert [label[u] for u in range(len(label))] == found.arc_label.tolist()
    assert len(tables["candidate"]) == found.solved.problem.candidates
    ends = {r["unit_no"]: [r["start_x"], r["start_y"], r["start_z"]] for r in tables["triangulated_unit"]}
    space = found.triangulated
    np.testing.assert_array_equal([ends[u] for u in space.first.tolist()], space.start)
    covariance = {r["unit_no"]: r["covariance"] for r in tables["triangulated_unit"]}
    np.testing.assert_array_equal(
        [covariance[u] for u in space.first.tolist()], space.covariance.reshape(len(space.first), 36)
    )
    curve = {r["unit_no"]: (r["curve"], r["centre_x"] is None) for r in tables["triangulated_unit"]}
    assert {bare for name, bare in curve.values() if name in ("line", "free")} == {True}
    assert {bare for name, bare in curve.values() if name in ("circle", "ellipse")} == {False}
