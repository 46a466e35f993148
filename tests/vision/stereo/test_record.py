"""A stereo match in the store, and its cost recomputed there."""

from __future__ import annotations

from collections.abc import Callable, Iterator

import numpy as np
import pytest

from relmodel.store.runs import Run
from relmodel.store.store import Store
from tests.vision.stereo.scenes import picture_of, toed_in_rig, wireframe_scene
from vision.stereo.match import StereoMatches, match_pictures, record_stereo

PROBLEM = 3


@pytest.fixture(scope="module")
def found() -> StereoMatches:
    rig = toed_in_rig()
    scene = wireframe_scene(rig, 4)
    return match_pictures(rig, picture_of(scene.left), picture_of(scene.right))


@pytest.fixture(scope="module")
def recorded(new_store: Callable[[str], str], found: StereoMatches) -> Iterator[tuple[Store, int]]:
    with Store.open(new_store("duckdb")) as store:
        with Run.begin(store, "inspect", {}) as run, run.write() as connection:
            sets = []
            for n, count in ((1, found.arcs[0]), (2, found.arcs[1])):
                run.append(
                    connection,
                    "image",
                    {
                        "id": [n],
                        "sha256": [f"{n}"],
                        "file_name": ["x.png"],
                        "width": [1280],
                        "height": [960],
                        "depth": [8],
                    },
                )
                run.append(
                    connection,
                    "extraction",
                    {
                        "id": [n],
                        "image_id": [n],
                        "content_key": [f"{n}"],
                        "bits": [8],
                        "bits_from": ["file"],
                        "parameters": ["{}"],
                        "version": ["1"],
                        "grey_dark": [0.0],
                        "grey_bright": [255.0],
                    },
                )
                sets.append(n)
                run.append(connection, "unit_set", {"id": [n], "kind": "extraction", "extraction_id": [n]})
                arcs = np.arange(count)
                run.append(connection, "unit", {"unit_set_id": n, "unit_no": arcs, "kind": "arc", "ref_no": arcs})
            record_stereo(run, connection, PROBLEM, sets[0], sets[1], found)
        yield store, run.id


def findings(store: Store) -> set[str]:
    with store.read() as connection:
        return {
            row.what for name in ("check/matching_cost", "check/matching_bound") for row in store.rows(connection, name)
        }


def test_the_assignment_holds_by_its_rows(recorded: tuple[Store, int]) -> None:
    assert findings(recorded[0]) == set()


def test_rows_say_what_was_found(recorded: tuple[Store, int], found: StereoMatches) -> None:
    store, run_id = recorded
    tables = {}
    with store.read() as connection:
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


@pytest.mark.parametrize(
    ("damage", "sign"),
    [
        (
            "UPDATE assignment SET label_no = NULL, reason = 'null_cheaper' WHERE label_no = {label}",
            "the cost of a decision",
        ),
        ("UPDATE assignment SET cost = cost + 1 WHERE unit_no = {unit}", "the cost of a decision"),
        ("UPDATE problem SET cost = cost + 1", "the cost of the problem"),
        (
            "UPDATE assignment SET label_no = {label}, reason = 'matched' WHERE label_no = {other}",
            "a label is taken twice",
        ),
        (
            "INSERT INTO candidate (run_id, problem_no, unit_no, label_no, cost) "
            "SELECT run_id, problem_no, 9999, label_no, cost FROM candidate "
            "WHERE unit_no = {unit} AND label_no = {label}",
            "a unit has no decision",
        ),
        ("UPDATE search_node SET bound = bound - 2", "the bound of the problem"),
        ("UPDATE problem SET bound = bound + 2", "the bound of the problem"),
    ],
)
def test_the_checks_see_through_damaged_rows(
    recorded: tuple[Store, int], found: StereoMatches, damage: str, sign: str
) -> None:
    store, _ = recorded
    unit, second = np.flatnonzero(found.arc_label >= 0)[:2]
    label, other = found.arc_label[[unit, second]]
    with store.engine.connect() as connection:
        connection.exec_driver_sql(damage.format(unit=unit, label=label, other=other))
        said = {
            row.what for name in ("check/matching_cost", "check/matching_bound") for row in store.rows(connection, name)
        }
        connection.rollback()
    assert sign in said
