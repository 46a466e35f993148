"""The house as its imports show it: which folder stands on which."""

from __future__ import annotations

import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import networkx as nx

CHECKOUT = Path(__file__).parents[1]
PACKAGES = ("relmodel", "vision")


_IMPORT = re.compile(r"^ *from (\S+) import (\([^)]*\)|.*)|^ *import (.*)", re.MULTILINE)


def imported(file: Path) -> Iterator[str]:
    """Modules of ours that a file names, wherever it does."""
    for source, names, modules in _IMPORT.findall(file.read_text()):
        for name in re.findall(r"[\w.]+", names or modules):
            yield f"{source}.{name}" if source else name


def folder_of(parts: tuple[str, ...]) -> str | None:
    """The folder a module belongs to; None for single modules of `relmodel`, which any folder may use."""
    return ".".join(parts[:2]) if len(parts) > 1 and (CHECKOUT / Path(*parts[:2])).is_dir() else None


@cache
def arrows() -> set[tuple[str, str]]:
    found = set()
    for file in (file for package in PACKAGES for file in (CHECKOUT / package).rglob("*.py")):
        own = folder_of(file.relative_to(CHECKOUT).parent.parts)
        for name in imported(file):
            other = folder_of(tuple(name.split("."))) if name.startswith(PACKAGES) else None
            if own and other and own != other:
                found.add((own, other))
    return found


def test_no_two_folders_import_each_other() -> None:
    assert list(nx.simple_cycles(nx.DiGraph(arrows()))) == []


def test_only_what_a_person_meets_knows_what_a_person_meets() -> None:
    assert {own for own, other in arrows() if other == "relmodel.app"} == set()


def test_vision_stands_on_relmodel() -> None:
    below = {own for own, other in arrows() if other.startswith("vision.")}
    assert {own for own in below if own.startswith("relmodel.")} == {"relmodel.app"}
