"""What an inspection wrote: made again it comes out as stored, what is altered is noticed, and what is pruned goes."""

from __future__ import annotations

import json
from pathlib import Path

import pytest
import sqlalchemy as sa

from benchmarks.alterations import measure
from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import Inspection, asked
from tests.given import Capsys, CopyStore


def test_alterations_are_noticed(blocks_seen: Inspection, tmp_path: Path) -> None:
    found = measure(Path(blocks_seen.store), blocks_seen.answer["run"], 1, 3, tmp_path)
    assert [one for one in found if one.noticed_by == "nobody"] == []


RELATION = "a relation is not what its candidates and tolerances give"
COMPATIBILITY = "a compatibility is not what the relations give"
TOLERANCE = "a tolerance is not what the parameters say"
OF_MATCHING = {
    """DELETE FROM compatibility WHERE problem_no = 1 AND NOT EXISTS (
        SELECT 1 FROM assignment AS a WHERE a.run_id = compatibility.run_id AND a.problem_no = compatibility.problem_no
            AND a.unit_no = unit_a AND a.label_no = label_a)""": {(1, COMPATIBILITY)},
    "UPDATE problem_tolerance SET nats = 9 WHERE problem_no = 0": {(0, RELATION), (0, COMPATIBILITY), (0, TOLERANCE)},
    "DELETE FROM problem_tolerance WHERE problem_no = 2 AND kind = 'near'": {(2, RELATION), (2, COMPATIBILITY)},
    "UPDATE problem SET nat_cost = 2 * nat_cost WHERE problem_no = 0": {
        (0, RELATION), (0, COMPATIBILITY), (0, "the weight of relations is not what the parameters say"),
    },
    """UPDATE unit_relation SET distance = distance + 30 WHERE kind = 'bounds' AND unit_set_id = (
        SELECT labels_id FROM problem WHERE problem_no = 1)""": {(1, COMPATIBILITY)},
}  # fmt: skip


def test_what_matching_goes_by_is_worked_out_anew(blocks_seen: Inspection, copy_store: CopyStore) -> None:
    """By the query that knows nothing of the digests of what was written."""
    with Store.open(copy_store(blocks_seen.store)) as store:
        with store.read() as connection:
            assert store.rows(connection, "check/matching_rows") == []
        for change, expected in OF_MATCHING.items():
            with store.engine.connect() as connection:
                changed = connection.exec_driver_sql(change)
                found = {(row.problem_no, row.what) for row in store.rows(connection, "check/matching_rows")}
                connection.rollback()
            assert found == expected, (change, changed.rowcount)


def altered(target: str, *statements: str) -> str:
    with Store.open(target) as store, store.write() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement)
    return target


def test_without_pictures_nothing_is_made_again(blocks_seen: Inspection, copy_store: CopyStore, capsys: Capsys) -> None:
    """Which is said, as it is of runs that inspected nothing; labellings are proved from their rows all the same."""
    store, run = altered(copy_store(blocks_seen.store), "DELETE FROM image_blob"), str(blocks_seen.answer["run"])
    refused = {run: f"so that run {run} cannot be made again", "1": "of kind load", "99": "there is no run 99"}
    for number, words in refused.items():
        assert main(["replay", number, "--store", store]) == 2
        assert words in capsys.readouterr().err
    altered(store, "DELETE FROM row_digest", "UPDATE problem SET cost = cost - 1 WHERE problem_no = 1")
    assert main(["check", "--store", store]) == 1
    assert "matching_cost" in capsys.readouterr().out


def counts(target: str) -> dict[str, int]:
    with Store.open(target, read_only=True) as store, store.read() as connection:
        names = [r.relation for r in store.rows(connection, "store/relations") if r.standing != "view"]
        each = (sa.select(sa.literal(name), sa.func.count()).select_from(store.table(name)) for name in names)
        return dict(map(tuple, connection.execute(sa.union_all(*each))))


def printed(capsys: Capsys, *words: str) -> dict[str, int]:
    capsys.readouterr()
    assert main([*words, "--format", "json"]) == 0
    return {row["relation"]: row["rows"] for row in json.loads(capsys.readouterr().out)}


@pytest.mark.parametrize("engine", ["blocks_seen", "blocks_on_postgresql"])
def test_what_would_go_goes_and_all_else_stays(
    engine: str, request: pytest.FixtureRequest, copy_store: CopyStore, capsys: Capsys
) -> None:
    made: Inspection = request.getfixturevalue(engine)
    target, run = copy_store(made.store), made.answer["run"]
    call = ["--store", target, "--run", str(run)]
    whole = counts(target)
    shown = printed(capsys, "prune", "pictures", *call)
    assert shown == {"image_blob": len(made.answer["world_from_camera"])}
    assert counts(target) == whole, "nothing goes unless it is told to"
    assert printed(capsys, "prune", "pictures", *call, "--yes") == shown
    assert printed(capsys, "prune", "pictures", *call, "--yes") == {}, "they went already"

    runs = printed(capsys, "prune", "runs", *call)
    assert printed(capsys, "prune", "runs", *call, "--yes") == runs
    left = counts(target)
    of_runs = {"run", "run_event", "ledger", "pruned_run"}
    assert {n: whole[n] - left[n] for n in whole if n not in of_runs and whole[n] != left[n]} == runs | shown
    found = ("inspection", "hypothesis", "view_arc", "correspondence", "edge_element", "image_arc", "unit", "threshold")
    assert not any(left[name] for name in found)
    stays = ("run_input", "image", "rig", "camera", "object_node", "placed_body", "arc")
    assert all(left[name] == whole[name] for name in stays)
    if engine == "blocks_seen":  # a server holds references itself
        assert main(["check", "--store", target]) == 0, capsys.readouterr().out
    assert main(["why", str(run), "--store", target]) == 2
    assert "was pruned by run" in capsys.readouterr().err


def test_a_selection_is_asked_for(blocks_seen: Inspection, capsys: Capsys) -> None:
    assert main(["prune", "runs", "--store", blocks_seen.store]) == 2
    assert "no runs are chosen for pruning" in capsys.readouterr().err
    for words in (("--older-than", "1"), ("--state", "failed"), ("--verdict", "refused")):
        assert printed(capsys, "prune", "runs", *words, "--store", blocks_seen.store) == {}
    assert "inspection" in printed(capsys, "prune", "runs", "--older-than", "0", "--store", blocks_seen.store)


def test_minimal_audit_keeps_decisions_and_pictures_of_others_stay(
    blocks_seen: Inspection, minimal: Inspection, capsys: Capsys
) -> None:
    target, first, again = minimal.store, blocks_seen.answer, minimal.answer

    kept = ("inspection", "hypothesis", "part_in_view", "verdict_statistic")
    left_out = ("view_arc", "correspondence", "edge_measurement", "problem", "candidate")
    count = "SELECT '{0}', (SELECT count(*) FROM {0} WHERE run_id = :again), count(*) FROM {0} WHERE run_id = :first"
    every = " UNION ALL ".join(count.format(table) for table in (*kept, *left_out, "threshold"))
    rows = {name: both for name, *both in asked(target, every, again=again["run"], first=first["run"])}
    assert all(rows[name][0] == rows[name][1] > 0 for name in kept)
    assert 0 < rows["threshold"][0] < rows["threshold"][1], "it matched no arcs to views"
    assert all(rows[name][0] == 0 < rows[name][1] for name in left_out)
    assert main(["check", "--store", target]) == 0, capsys.readouterr().out
    shown = printed(capsys, "prune", "runs", "--run", str(first["run"]), "--store", target)
    assert {"image_blob", "extraction", "edge_element"}.isdisjoint(shown), "the other run has read these pictures too"
