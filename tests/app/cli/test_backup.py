"""A store survives DuckDB's own backup: what docs/store.md tells a person to do."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path
from typing import Any

import duckdb
import pytest

from relmodel.app.cli.main import main
from tests.app.cli.conftest import Inspection

PAGE = (Path(__file__).parents[3] / "docs/store.md").read_text()
QUESTIONS = ["SELECT * FROM matched_arc ORDER BY ALL", "SELECT * FROM run_summary ORDER BY ALL"] + [
    f"SELECT * FROM {level}_in_{volume} ORDER BY ALL"  # noqa: S608
    for level in ("parts", "features", "surfaces", "arcs")
    for volume in (
        "box(-60, -60, -5, 60, 60, 40)",
        "sphere(0, 0, 10, 60)",
        "view((SELECT min(id) FROM camera), 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, -200, 10, 300)",
    )
]


def block(language: str) -> str:
    """The block of the page's part on backups that is in a language."""
    part = PAGE[PAGE.index("**Backup.**") :]
    (found,) = re.findall(rf"^```{language}\n(.*?)^```", part, re.MULTILINE | re.DOTALL)
    return str(found)


@pytest.fixture(scope="module", params=["by program", "restored"])
def both(
    request: pytest.FixtureRequest, blocks_seen: Inspection, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    """A store with an inspection, and what the page's commands make of it."""
    folder = tmp_path_factory.mktemp("backup")
    shutil.copy(blocks_seen.store, folder / "cell.duckdb")
    programs = Path(sys.executable).parent
    commands = {"by program": [str(programs / "duckdb"), "-bail"], "restored": ["sh", "-e"]}
    typed = block("sh" if request.param == "restored" else "sql")
    environment = {"PATH": f"{programs}:/usr/bin:/bin", "HOME": str(folder)}
    done = subprocess.run(
        commands[request.param], input=typed, cwd=folder, env=environment, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "cell.duckdb", folder / ("restored.duckdb" if request.param == "restored" else "copied.duckdb")


DIGESTS = "SELECT '{t}', count(*), sum(hash(t)::HUGEINT) FROM {name}.\"{t}\" AS t"


def test_all_rows_rules_comments_and_answers_are_equal(both: tuple[Path, Path]) -> None:
    said: dict[str, list[Any]] = {}
    with duckdb.connect() as connection:
        for name, file in zip(("old", "new"), both, strict=True):
            connection.execute(f"ATTACH '{file}' AS {name} (READ_ONLY)")
            of = f"WHERE database_name = '{name}'"
            tables = connection.execute(f"SELECT table_name FROM duckdb_tables() {of} ORDER BY 1").fetchall()  # noqa: S608
            # How many rows, and a sum over the digests of all of them, in whatever order they lie.
            digests = " UNION ALL ".join(DIGESTS.format(t=table, name=name) for (table,) in tables)
            rules = f"SELECT count(*), count(DISTINCT constraint_text) FROM duckdb_constraints() {of}"  # noqa: S608
            said[name] = [connection.execute(asked).fetchall() for asked in (f"{digests} ORDER BY 1", rules)]
            comments = connection.execute(f"SELECT count(comment) FROM duckdb_columns() {of}").fetchall()[0][0]  # noqa: S608
            assert comments > 1000 or both[1].name == "restored.duckdb"  # EXPORT DATABASE leaves them out
    assert said["old"] == said["new"]
    assert sum(count > 0 for _, count, _ in said["old"][0]) > 50
    answers = []
    for file in both:
        with duckdb.connect(str(file), read_only=True) as connection:
            answers.append([connection.execute(asked).fetchall() for asked in QUESTIONS])
    assert answers[0] == answers[1]
    assert all(answers[0])
    assert main(["set", "blocks", "batch", "7", "--store", str(both[1])]) == 0
