"""A store survives DuckDB's own backup: what docs/store.md tells a person to do."""

from __future__ import annotations

import re
import shutil
import subprocess
import sys
from pathlib import Path

import duckdb
import pytest

from relmodel.app.cli.main import main
from tests.app.cli.conftest import Inspection

PAGE = (Path(__file__).parents[3] / "docs/store.md").read_text()
QUESTIONS = [
    f"SELECT * FROM {level}_in_{volume} ORDER BY ALL"  # noqa: S608
    for level in ("parts", "features", "surfaces", "arcs")
    for volume in (
        "box(1650, -480, 960, 1700, -440, 990)",
        "sphere(1675, -460, 975, 40)",
        "view((SELECT min(id) FROM camera), 1, 0, 0, 1675, 0, 1, 0, -460, 0, 0, 1, 800, 10, 300)",
    )
]


def block(language: str) -> str:
    """The block of the page's part on backups that is in a language."""
    part = PAGE[PAGE.index("**Backup.**") :]
    (found,) = re.findall(rf"^```{language}\n(.*?)^```", part, re.MULTILINE | re.DOTALL)
    return str(found)


@pytest.fixture(scope="module", params=["by program", "without options", "restored"])
def both(
    request: pytest.FixtureRequest, inspection: Inspection, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, Path]:
    """A store with an inspection, and what the page's commands make of it."""
    folder = tmp_path_factory.mktemp("backup")
    shutil.copy(inspection.store, folder / "cell.duckdb")
    programs = Path(sys.executable).parent
    commands = {
        "by program": [str(programs / "duckdb"), "-bail"],
        "without options": [str(programs / "duckdb"), "-bail"],
        "restored": ["sh", "-e"],
    }
    typed = block("sh" if request.param == "restored" else "sql")
    if request.param == "without options":
        typed = re.sub(r"'copied.duckdb' AS new \(.*\)", "'copied.duckdb' AS new", typed)
        assert "BLOCK_SIZE" not in typed
    environment = {"PATH": f"{programs}:/usr/bin:/bin", "HOME": str(folder)}
    done = subprocess.run(
        commands[request.param], input=typed, cwd=folder, env=environment, capture_output=True, text=True
    )
    assert (done.returncode, done.stderr) == (0, "")
    return folder / "cell.duckdb", folder / ("restored.duckdb" if request.param == "restored" else "copied.duckdb")


def test_all_tables_are_equal(both: tuple[Path, Path]) -> None:
    with duckdb.connect() as connection:
        for name, file in zip(("old", "new"), both, strict=True):
            connection.execute(f"ATTACH '{file}' AS {name} (READ_ONLY)")
        tables = connection.execute(
            "SELECT database_name, list(table_name ORDER BY table_name) FROM duckdb_tables() GROUP BY 1"
        ).fetchall()
        names = dict(tables)
        assert names["new"] == names["old"]
        rows = {}
        for name in names:  # how many, and a sum over all of the digests of whole rows, in whatever order they lie
            digests = (
                f"SELECT '{table}', count(*), sum(hash(t)::HUGEINT) FROM {name}.\"{table}\" AS t"  # noqa: S608
                for table in names[name]
            )
            rows[name] = connection.execute(" UNION ALL ".join(digests) + " ORDER BY 1").fetchall()
        assert rows["new"] == rows["old"]
        assert sum(count > 0 for _, count, _ in rows["old"]) > 50
        rules = connection.execute(
            "SELECT database_name, count(*), count(DISTINCT constraint_text) FROM duckdb_constraints() GROUP BY 1"
        ).fetchall()
        assert len({row[1:] for row in rules}) == 1
        comments = dict(
            connection.execute(
                "SELECT database_name, list((table_name, column_name, comment) ORDER BY table_name, column_name) "
                "FROM duckdb_columns() WHERE comment IS NOT NULL GROUP BY 1"
            ).fetchall()
        )
        assert len(comments["old"]) > 1000
        # EXPORT DATABASE leaves them out.
        assert comments.get("new") == (None if both[1].name == "restored.duckdb" else comments["old"])


def test_views_and_macros_answer_as_before(both: tuple[Path, Path]) -> None:
    answers = []
    for file in both:
        with duckdb.connect(str(file), read_only=True) as connection:
            views = [
                f'SELECT * FROM "{name}" ORDER BY ALL'  # noqa: S608
                for (name,) in connection.execute(
                    "SELECT view_name FROM duckdb_views() WHERE NOT internal ORDER BY 1"
                ).fetchall()
            ]
            assert len(views) > 5
            answers.append([connection.execute(asked).fetchall() for asked in views + QUESTIONS])
    assert answers[0] == answers[1]
    assert all(answers[0][-len(QUESTIONS) :])


def test_the_store_can_be_written_to_and_is_sound(both: tuple[Path, Path]) -> None:
    store = str(both[1])
    assert main(["set", "bulkhead/BODY", "batch", "7", "--variant", "A", "--store", store]) == 0
    assert main(["check", "--store", store]) == 0
