"""`relmodel prune` and `--audit minimal`: what goes, what stays, and that the store is whole afterwards."""

from __future__ import annotations

import json
from typing import Any

import duckdb
import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import Inspection
from tests.given import Capsys, CopyStore


def counts(store: Store) -> dict[str, int]:
    with store.read() as connection:
        names = [r.relation for r in store.rows(connection, "store/relations") if r.standing != "view"]
        select = sa.select(sa.func.count())
        return {name: connection.execute(select.select_from(store.table(name))).scalar_one() for name in names}


def printed(capsys: Capsys, *words: str) -> dict[str, int]:
    capsys.readouterr()
    assert main([*words, "--format", "json"]) == 0
    return {row["relation"]: row["rows"] for row in json.loads(capsys.readouterr().out)}


@pytest.mark.parametrize("engine", ["inspection", "postgresql_inspection"])
def test_what_would_go_goes_and_all_else_stays(
    engine: str, request: pytest.FixtureRequest, copy_store: CopyStore, capsys: Capsys
) -> None:
    made: Inspection = request.getfixturevalue(engine)
    target, run = copy_store(made.store), made.answer["run"]
    call = ["--store", target, "--run", str(run)]
    with Store.open(target, read_only=True) as store:
        whole = counts(store)
    shown = printed(capsys, "prune", "pictures", *call)
    assert shown == {"image_blob": 2}
    with Store.open(target, read_only=True) as store:
        assert counts(store) == whole, "nothing goes unless it is told to"
    assert printed(capsys, "prune", "pictures", *call, "--yes") == shown
    assert printed(capsys, "prune", "pictures", *call, "--yes") == {}, "they went already"

    shown = printed(capsys, "prune", "runs", *call)
    assert printed(capsys, "prune", "runs", *call, "--yes") == shown
    with Store.open(target, read_only=True) as store:
        left = counts(store)
    of_runs = {"run", "run_event", "ledger", "pruned_run"}
    assert {n: whole[n] - left[n] for n in whole if n not in of_runs and whole[n] != left[n]} == {
        **shown,
        "image_blob": 2,
    }
    found = ("inspection", "hypothesis", "view_arc", "correspondence", "edge_element", "image_arc", "unit", "threshold")
    assert not any(left[name] for name in found)
    stays = ("run_input", "image", "rig", "camera", "object_node", "placed_body", "arc")
    assert all(left[name] == whole[name] for name in stays)
    assert main(["check", "--store", target]) == 0, capsys.readouterr().out
    capsys.readouterr()
    assert main(["why", str(run), "--store", target]) == 2
    assert "was pruned by run" in capsys.readouterr().err


def test_a_selection_is_asked_for(inspection: Inspection, capsys: Capsys) -> None:
    assert main(["prune", "runs", "--store", inspection.store]) == 2
    assert "no runs are chosen for pruning" in capsys.readouterr().err
    for words in (("--older-than", "1"), ("--state", "failed"), ("--verdict", "refused")):
        assert printed(capsys, "prune", "runs", *words, "--store", inspection.store) == {}
    assert "inspection" in printed(capsys, "prune", "runs", "--older-than", "0", "--store", inspection.store)


def test_minimal_audit_keeps_decisions_and_pictures_of_others_stay(
    inspection: Inspection, minimal: Inspection, capsys: Capsys
) -> None:
    target, first, again = minimal.store, inspection.answer, minimal.answer

    def rows(table: str, run: Any) -> int:
        with duckdb.connect(target, read_only=True) as connection:
            query = f"SELECT count(*) FROM {table} WHERE run_id = {run}"  # noqa: S608
            (count,) = connection.execute(query).fetchall()[0]
            return int(count)

    for table in ("inspection", "hypothesis", "part_in_view", "verdict_statistic", "threshold"):
        assert rows(table, again["run"]) == rows(table, first["run"]) > 0
    for table in ("view_arc", "correspondence", "edge_measurement", "problem", "candidate"):
        assert rows(table, again["run"]) == 0 < rows(table, first["run"])
    assert main(["check", "--store", target]) == 0, capsys.readouterr().out
    shown = printed(capsys, "prune", "runs", "--run", str(first["run"]), "--store", target)
    assert {"image_blob", "extraction", "edge_element"}.isdisjoint(shown), "the other run has read these pictures too"
