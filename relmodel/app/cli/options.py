"""Options that several verbs share."""

from __future__ import annotations

import argparse
import os
from collections.abc import Sequence
from pathlib import Path

from relmodel.errors import UsageError


def add_store(parser: argparse.ArgumentParser) -> None:
    """`--store`, which every verb has."""
    parser.add_argument(
        "--store",
        metavar="FILE-or-URL",
        help="the store: a DuckDB file, or a postgresql+psycopg:// URL (default: the environment's RELMODEL_STORE)",
    )


def add_debug(parser: argparse.ArgumentParser) -> None:
    """`--debug`, which every verb has."""
    parser.add_argument("--debug", action="store_true", help="print the traceback of an internal error")


def add_quiet(parser: argparse.ArgumentParser) -> None:
    """`--quiet`, which every verb has."""
    parser.add_argument("--quiet", action="store_true", help="print only data and errors: no messages, no progress")


def store_target(args: argparse.Namespace) -> str:
    """The store that the call names.  Raises UsageError where neither the option nor the environment does."""
    target = args.store or os.environ.get("RELMODEL_STORE")
    if not target:
        raise UsageError("no store is named: give --store FILE-or-URL or set RELMODEL_STORE")
    return str(target)


def add_run(parser: argparse.ArgumentParser) -> None:
    """`RUN` or `--run RUN` of a verb that is about one run; None where neither is given."""
    run = parser.add_mutually_exclusive_group()
    run.add_argument(
        "number",
        nargs="?",
        default=argparse.SUPPRESS,  # or it would override --run
        metavar="RUN",
        help="the run: its number, or last, the newest inspection (default)",
    )
    run.add_argument("--run", dest="number", metavar="RUN", help="the same as RUN")


def add_pictures(parser: argparse.ArgumentParser, words: str) -> None:
    """`CAMERA=PICTURE`, as often as there are pictures: `pictures_by_camera` reads them."""
    parser.add_argument("pictures", nargs="*", metavar="CAMERA=PICTURE", help=words)


def pictures_by_camera(words: Sequence[str]) -> dict[str, Path]:
    """Pictures by camera, one without a name under an empty one.  Raises UsageError where a name stands twice."""
    found: dict[str, Path] = {}
    for word in words:
        name, path = word.split("=", 1) if "=" in word else ("", word)
        if not path:
            raise UsageError(f"'{word}' names no picture: give it as CAMERA=PICTURE")
        if name in found:
            of = f"of the camera '{name}'" if name else "without the name of a camera"
            raise UsageError(f"two pictures are given {of}: give one of each camera, as CAMERA=PICTURE")
        found[name] = Path(path)
    return found


def add_search(parser: argparse.ArgumentParser) -> None:
    """`--search`, which every verb that matches has."""
    parser.add_argument(
        "--search",
        default="dual_ascent",
        metavar="SEARCH",
        help="the search for the best match: dual_ascent, paper or star, "
        "described in docs/matching.md (default: dual_ascent)",
    )


def add_format(parser: argparse.ArgumentParser) -> None:
    """`--format`, which every verb that prints data has."""
    parser.add_argument(
        "--format", choices=("table", "json", "csv"), default="table", help="how data is printed (default: table)"
    )


def add_all(parser: argparse.ArgumentParser) -> None:
    """`--all`, of verbs whose table may be long: `relmodel.app.cli.output.print_folded`."""
    parser.add_argument(
        "--all", action="store_true", help="print all rows and columns of the table, however long and wide they are"
    )
