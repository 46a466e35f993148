"""How big the house is, held against its limits: `make house` prints the table and fails where one is passed.

Lines are counted as `wc -l` does, of what git tracks; the files of an inspection are those of docs/architecture.md."""

from __future__ import annotations

import ast
import re
import subprocess
import sys
from collections.abc import Iterator
from pathlib import Path

import networkx as nx

from relmodel.printing import print_rows

CHECKOUT = Path(__file__).parents[1]
PRODUCT = ("relmodel", "vision", "schema", "queries")
BESIDE = ("tests", "benchmarks", "examples")
PATH = "## The files of an inspection"
MOST_PARAMETERS = 7

LIMITS = {
    "lines of the product": 60_660,
    "Python files of the product": 220,
    "tables": 110,
    "functions of many parameters, on an inspection's path": 0,
    "functions of many parameters, elsewhere": 40,
    "modules in circles": 0,
    "lines of tests, benchmarks and examples": 46_300,
}


def tracked(*folders: str, ending: str = "") -> list[Path]:
    """What git tracks below some folders."""
    git = subprocess.run(["git", "ls-files", "-z", *folders], cwd=CHECKOUT, capture_output=True, check=True, text=True)
    files = (CHECKOUT / name for name in git.stdout.split("\0") if name.endswith(ending) and name)
    return [file for file in files if file.is_file()]


def lines(files: list[Path]) -> int:
    return sum(file.read_bytes().count(b"\n") for file in files)


def module_of(file: Path) -> str:
    parts = file.relative_to(CHECKOUT).with_suffix("").parts
    return ".".join(parts[:-1] if parts[-1] == "__init__" else parts)


def count_parameters(function: ast.FunctionDef | ast.AsyncFunctionDef) -> int:
    """Parameters by whatever way they are given, the object of a method not counted."""
    by_place = [argument.arg for argument in (*function.args.posonlyargs, *function.args.args)]
    return len(by_place) + len(function.args.kwonlyargs) - (by_place[:1] in (["self"], ["cls"]))


def with_many_parameters(file: Path) -> Iterator[str]:
    for node in ast.walk(ast.parse(file.read_text())):
        if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef) and count_parameters(node) > MOST_PARAMETERS:
            yield f"{file.relative_to(CHECKOUT)}:{node.lineno} {node.name}"


def circles(files: list[Path]) -> list[list[str]]:
    """Modules that import each other while they are imported, directly or by others."""
    modules = {module_of(file) for file in files}
    graph: nx.DiGraph[str] = nx.DiGraph()
    for file in files:
        for node in ast.parse(file.read_text()).body:
            if isinstance(node, ast.ImportFrom) and node.module in modules:
                named = (f"{node.module}.{alias.name}" for alias in node.names)
                graph.add_edges_from((module_of(file), name if name in modules else node.module) for name in named)
    return [sorted(found) for found in nx.strongly_connected_components(graph) if len(found) > 1]


def files_of_an_inspection() -> set[Path]:
    """What the page on the architecture names as the way of an inspection."""
    page = (CHECKOUT / "docs/architecture.md").read_text()
    section = page.partition(PATH)[2].partition("\n## ")[0]
    return {CHECKOUT / name for name in re.findall(r"`((?:relmodel|vision)/[\w/]+\.py)`", section)}


def measure() -> tuple[dict[str, int], list[str]]:
    """The figures that have limits, and which functions have many parameters."""
    python = tracked("relmodel", "vision", ending=".py")
    on_path = files_of_an_inspection()
    many = {file: list(with_many_parameters(file)) for file in python}
    tables = sum(len(re.findall(r"^CREATE TABLE", file.read_text(), re.M)) for file in tracked("schema", ending=".sql"))
    figures = (
        lines(tracked(*PRODUCT)),
        len(python),
        tables,
        sum(len(found) for file, found in many.items() if file in on_path),
        sum(len(found) for file, found in many.items() if file not in on_path),
        sum(len(found) for found in circles(python)),
        lines(tracked(*BESIDE, ending=".py")),
    )
    return dict(zip(LIMITS, figures, strict=True)), [name for found in many.values() for name in found]


def main() -> int:
    figures, many = measure()
    passed = [name for name, limit in LIMITS.items() if figures[name] > limit]
    print_rows(["figure", "now", "at most"], [[name, figures[name], LIMITS[name]] for name in LIMITS], "table")
    missing = sorted(str(file.relative_to(CHECKOUT)) for file in files_of_an_inspection() if not file.exists())
    if missing:
        print(f"docs/architecture.md names what is not there: {', '.join(missing)}")
    if not files_of_an_inspection():
        print(f"docs/architecture.md has no section {PATH!r}")
    for name in passed:
        print(f"too many: {name}, {figures[name] - LIMITS[name]} over")
    if "--functions" in sys.argv:
        print("\n".join(many))
    return bool(passed or missing or not files_of_an_inspection())


if __name__ == "__main__":
    sys.exit(main())
