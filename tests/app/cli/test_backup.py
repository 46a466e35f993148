"""A store survives DuckDB's own backup: what docs/store.md tells a person to do."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from functools import cache
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


DIGEST = "SELECT '{0}', count(*), sum(hash(t)::HUGEINT) FROM \"{0}\" AS t"


@cache  # of the store that both ways begin with
def content(file: str) -> tuple[list[list[Any]], int]:
    """Rows of each table with a sum over their digests, in any order; rules; answers; columns with comments."""
    with duckdb.connect(file, read_only=True) as connection:

        def ask(question: str) -> list[Any]:
            return connection.execute(question).fetchall()

        tables = [name for (name,) in ask("SELECT table_name FROM duckdb_tables()")]
        digests = " UNION ALL ".join(DIGEST.format(table) for table in tables)
        rules = "SELECT count(*), count(DISTINCT constraint_text) FROM duckdb_constraints()"
        ((comments,),) = ask("SELECT count(comment) FROM duckdb_columns()")
        return [ask(question) for question in (f"{digests} ORDER BY 1", rules, *QUESTIONS)], comments


@pytest.mark.parametrize("way", ["by program", "restored"])
def test_all_rows_rules_comments_and_answers_are_equal(way: str, blocks_seen: Inspection, tmp_path: Path) -> None:
    """Of a store with an inspection, by what the page's commands make of it."""
    shutil.copy(blocks_seen.store, tmp_path / "cell.duckdb")
    programs = Path(sys.executable).parent
    commands = {"by program": [str(programs / "duckdb"), "-bail"], "restored": ["sh", "-e"]}
    typed = block("sh" if way == "restored" else "sql")
    environment = {"PATH": f"{programs}:/usr/bin:/bin", "HOME": str(tmp_path)}
    done = subprocess.run(commands[way], input=typed, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert (done.returncode, done.stderr) == (0, "")
    made = tmp_path / ("restored.duckdb" if way == "restored" else "copied.duckdb")
    (before, _), (after, comments) = content(blocks_seen.store), content(str(made))
    assert comments > 1000 or way == "restored"  # EXPORT DATABASE leaves them out
    assert after == before
    assert sum(count > 0 for _, count, _ in before[0]) > 50
    assert all(before)
    assert main(["set", "blocks", "batch", "7", "--store", str(made)]) == 0
