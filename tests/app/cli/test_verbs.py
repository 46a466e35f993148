"""What the verbs print and refuse."""

from __future__ import annotations

import csv
import io
import json
import subprocess
import sys
from contextlib import ExitStack
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from relmodel.app.cli.main import main
from relmodel.store import Run, Store
from tests.conftest import make_reader
from tests.given import Capsys, CopyStore


def printed(capsys: Capsys, *arguments: str) -> list[dict[str, Any]]:
    capsys.readouterr()
    assert main([*arguments, "--format", "json"]) == 0
    rows: list[dict[str, Any]] = json.loads(capsys.readouterr().out)
    return rows


@pytest.fixture
def asked_store(fresh_store: str) -> str:
    """A store with nothing in it, once on each engine, for one who only reads."""
    return make_reader(fresh_store)


FUNCTIONS = {"parts_within_box", "nearest_parts", "features_within_box", "nearest_features"} | {
    f"{level}_in_{of}"
    for level in ("parts", "features", "surfaces", "arcs")
    for of in ("box", "boxes", "volumes", "sphere", "view")
}
# What the engines' own catalogues say that their functions take; DuckDB's keeps no types.
ARGUMENTS = {
    "duckdb": "SELECT function_name, parameters, CAST(NULL AS TEXT[]) FROM duckdb_functions() WHERE NOT internal",
    "postgresql": "SELECT proname, CAST(proargnames[1:pronargs] AS TEXT[]), CAST(CAST(CAST(proargtypes AS OID[]) AS "
    "REGTYPE[]) AS TEXT[]) FROM pg_proc WHERE pronamespace = CAST(current_schema() AS REGNAMESPACE)",
}


def test_schema_has_every_column_and_argument_with_a_comment(fresh_store: str, capsys: Capsys) -> None:
    with Store.open(fresh_store) as store, store.read() as connection:
        found = connection.exec_driver_sql(ARGUMENTS[store.dialect]).fetchall()
        metadata = sa.MetaData()
        metadata.reflect(connection, views=True)
    taken = {name: (list(arguments), types) for name, arguments, types in found if name in FUNCTIONS}
    assert taken.keys() == FUNCTIONS
    columns = printed(capsys, "schema", "--columns", "--store", fresh_store)
    assert all(column["comment"] for column in columns)
    reflected = {(t.name, c.name) for t in metadata.tables.values() for c in t.columns if t.name != "alembic_version"}
    arguments_of = {(name, argument) for name, (arguments, _) in taken.items() for argument in arguments}
    assert {(c["relation"], c["column"]) for c in columns} == reflected | arguments_of
    for name, (arguments, types) in taken.items():
        told = [row for row in columns if row["relation"] == name]
        assert [row["column"] for row in told] == arguments
        assert types is None or [str(row["type"]).lower() for row in told] == [str(t) for t in types]
        numbers = [str(row["comment"]) for row in told if row["type"] == "DOUBLE PRECISION"]
        assert numbers or "asked" in arguments  # a table's name
        assert all("mm" in comment or "rotation" in comment for comment in numbers)


def test_schema_is_a_line_a_relation_and_a_function_and_needs_no_store(
    duckdb_file: Path, capsys: Capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    entries = printed(capsys, "schema", "--store", str(duckdb_file))
    assert all(entry["comment"] for entry in entries)
    names = [entry["relation"] for entry in entries]
    assert len(names) == len(set(names))
    with Store.open(duckdb_file) as store, store.read() as connection:
        relations = {row.relation for row in store.rows(connection, "store/relations")}
    functions = {entry["relation"] for entry in entries if entry["standing"] == "function"}
    assert set(names) - functions == relations
    assert functions == FUNCTIONS
    monkeypatch.delenv("RELMODEL_STORE", raising=False)
    assert printed(capsys, "schema") == entries


def test_schema_of_one_relation_is_in_full(duckdb_file: Path, capsys: Capsys) -> None:
    rows = {row["column"]: row for row in printed(capsys, "schema", "loop", "--store", str(duckdb_file))}
    assert (rows["loop_no"]["key"], rows["outer_loop"]["key"]) == (True, False)
    assert rows["surface_id"]["refers_to"] == "surface (id)"
    assert main(["schema", "lop", "--store", str(duckdb_file)]) == 2
    assert "did you mean loop?" in capsys.readouterr().err


def test_sql_prints_rows_in_each_form(asked_store: str, capsys: Capsys, tmp_path: Path) -> None:
    query = "SELECT relation, NULL AS nothing FROM sds_relation WHERE relation IN ('arc', 'loop') ORDER BY relation"
    rows = printed(capsys, "sql", "--store", asked_store, query)
    assert rows == [{"relation": "arc", "nothing": None}, {"relation": "loop", "nothing": None}]
    file = tmp_path / "query.sql"
    file.write_text(query)
    assert main(["sql", "--store", asked_store, "--file", str(file), "--format", "csv"]) == 0
    said = list(csv.reader(io.StringIO(capsys.readouterr().out)))
    assert said == [["relation", "nothing"], ["arc", ""], ["loop", ""]]
    assert main(["sql", "--store", asked_store, query]) == 0
    assert capsys.readouterr().out.split()[0] == "relation"


def test_sql_reads_stdin(duckdb_template: Path, capsys: Capsys, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("sys.stdin", io.StringIO("SELECT ':a' AS colon, '%s' AS percent"))
    assert printed(capsys, "sql", "--store", str(duckdb_template)) == [{"colon": ":a", "percent": "%s"}]


# A single call of a function, of hours, in which DuckDB does not look whether it was interrupted.
UNHEEDING = "SELECT sum(levenshtein(repeat('a', 4000000 + i::INT), repeat('b', 4000000))) FROM range(9) AS t(i)"


def test_sql_ends_at_its_limit(duckdb_file: Path) -> None:
    """Though nobody reads what it prints, which is more than a pipe holds, or the database does not heed it."""
    before = duckdb_file.read_bytes()
    command = [sys.executable, "-m", "relmodel", "sql", "--timeout", "0.2", "--store", str(duckdb_file)]
    stopped = "relmodel sql: the statement was stopped after 0.2 s: ask for less, or give it more time\n"
    with ExitStack() as stack:
        processes = []
        for statement in ("SELECT repeat('x', 50) FROM range(20000)", UNHEEDING):
            started = subprocess.Popen([*command, statement], stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True)
            processes.append(stack.enter_context(started))
            stack.callback(started.kill)
        for process in processes:
            assert process.wait(60) == 3
            assert process.stderr is not None
            assert process.stderr.read() == stopped
    assert duckdb_file.read_bytes() == before


def test_sql_refuses_what_is_wrong_or_writes(asked_store: str, capsys: Capsys) -> None:
    """Whatever else is refused, the tests of `relmodel.store.ask` hold."""
    for statement in ("SELCT 1", "COMMIT; DELETE FROM sds_relation; COMMIT"):
        assert main(["sql", "--store", asked_store, statement]) == 3, statement
        said = capsys.readouterr()
        assert (said.out, said.err.count("\n")) == ("", 1)
    with Store.open(asked_store) as store, store.read() as connection:
        assert len(store.rows(connection, "store/relations")) > 50


def test_sql_on_duckdb_reaches_no_file_and_no_setting(duckdb_template: Path, tmp_path: Path, capsys: Capsys) -> None:
    (tmp_path / "in.csv").write_text("a\n1\n")
    for statement in (
        f"COPY (SELECT 1) TO '{tmp_path}/out.csv'",
        f"SELECT * FROM read_csv('{tmp_path}/in.csv')",  # noqa: S608
        f"ATTACH '{tmp_path}/other.duckdb'",
        "SET enable_external_access = true",
        "SET lock_configuration = false",
        "SET memory_limit = '100GB'",
    ):
        assert main(["sql", "--store", str(duckdb_template), statement]) == 3, statement
        assert "refused" in capsys.readouterr().err
    assert sorted(path.name for path in tmp_path.iterdir()) == ["in.csv"]


def test_runs_lists_states_and_filters(duckdb_file: Path, capsys: Capsys) -> None:
    with Store.open(duckdb_file) as store:
        with Run.begin(store, "load", {}):
            pass
        with pytest.raises(ValueError, match="wrong"), Run.begin(store, "world", {}):
            raise ValueError("wrong")
    rows = printed(capsys, "runs", "--store", str(duckdb_file))
    states = [(r["kind"], r["state"], r["message"]) for r in rows]
    assert states == [("world", "failed", "wrong"), ("load", "finished", None)]
    assert all(isinstance(r["seconds"], float) for r in rows)
    assert [r["kind"] for r in printed(capsys, "runs", "--store", str(duckdb_file), "--state", "finished")] == ["load"]
    assert [r["kind"] for r in printed(capsys, "runs", "--store", str(duckdb_file), "--kind", "world")] == ["world"]


def test_a_world_says_whether_it_is_new(
    blocks_template: Path, copy_store: CopyStore, tmp_path: Path, capsys: Capsys
) -> None:
    store, world = copy_store(str(blocks_template)), tmp_path / "world.yaml"
    world.write_text("world: table\nobjects: [{object: blocks, name: other}]\n")
    for said in ("added", "unchanged"):
        assert main(["world", str(world), "--store", store]) == 0
        assert f"table, revision 2: {said}" in capsys.readouterr().err
