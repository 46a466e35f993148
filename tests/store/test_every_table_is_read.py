"""No table without a reader that a user meets: a question of the documentation, or a query of a verb or a page.

What `relmodel check` and `relmodel prune` ask does not count: a table that only these read could go."""

from __future__ import annotations

import re
from collections.abc import Iterable
from pathlib import Path

from relmodel.resources import resource_dir
from relmodel.store import Store, sql

CHECKOUT = Path(__file__).parents[2]
OF_NO_USER = {"check", "prune"}

# Tables that nothing which a user meets reads, and why they are there all the same.
WITHOUT_READER = {"row_digest": "relmodel check holds the rows against it: it has no other use"}


def relations_read(text: str) -> set[str]:
    """Names after FROM and JOIN in SQL, but those that the statement makes itself."""
    own = set(re.findall(r"\b(\w+) (?:\([\w, ]*\) )?AS (?:MATERIALIZED )?\(", text))
    return set(re.findall(r"\b(?:FROM|JOIN)\s+(\w+)", text)) - own


def without_comments(text: str) -> str:
    return re.sub(r"--.*", "", text)


def views_and_functions() -> dict[str, set[str]]:
    """What each view and function of the schema reads."""
    statements = re.split(r"^(?=CREATE |INSERT )", "\n".join(sql.schema_scripts("duckdb")), flags=re.MULTILINE)
    made = [(re.match(r"CREATE (?:VIEW|MACRO) (\w+)", statement), statement) for statement in statements]
    return {name[1]: relations_read(without_comments(text)) for name, text in made if name}


def reached(names: Iterable[str]) -> set[str]:
    """Names of relations and functions, and those behind them."""
    behind, seen, ahead = views_and_functions(), set[str](), list(names)
    while ahead:
        name = ahead.pop()
        if name not in seen:
            seen.add(name)
            ahead += behind.get(name, ())
    return seen


def pages() -> list[str]:
    """The pages of the documentation."""
    return [page.read_text() for page in (*(CHECKOUT / "docs").glob("*.md"), CHECKOUT / "README.md")]


def asked_by_users(store: Store) -> set[str]:
    """Relations and functions that queries, the blocks of code of the documentation, and functions to call name."""
    folder = resource_dir("queries")
    queries = [file for file in folder.rglob("*.sql") if file.relative_to(folder).parts[0] not in OF_NO_USER]
    blocks = [block for page in pages() for block in re.findall(r"```\w+\n(.*?)```", page, re.DOTALL)]
    with store.read() as connection:
        functions = {row.function_name for row in store.rows(connection, "store/arguments")}
    read = [without_comments(file.read_text()) for file in queries] + blocks
    return functions.union(selected_by_key(), *(relations_read(text) for text in read))


def selected_by_key() -> set[str]:
    """Names that modules hold which read tables by their keys, without a query."""
    files = [file for folder in ("relmodel", "vision") for file in (CHECKOUT / folder).rglob("*.py")]
    # the store checks rows, and a replay compares them: neither is asked by a user
    modules = [file.read_text() for file in files if file.parent.name != "store" and file.name != "replay.py"]
    return {name for text in modules if ".select(" in text for name in re.findall(r'"(\w+)"', text)}


def test_every_table_has_a_reader_that_a_user_meets(duckdb_template: Path) -> None:
    with Store.open(duckdb_template, read_only=True) as store:
        read = reached(asked_by_users(store))
        with store.read() as connection:
            rows = store.rows(connection, "store/relations")
    tables = {row.relation for row in rows if row.standing != "view"}
    assert len(tables) > 80
    assert tables - read - WITHOUT_READER.keys() == set()
    assert WITHOUT_READER.keys() & read == set()  # has a reader now: no exception
    documented = {name for page in pages() for name in re.findall(r"`(\w+)`", page)}
    assert {row.relation for row in rows} - tables - read - documented == set()
