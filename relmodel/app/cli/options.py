"""How verbs are declared, the options that several share, and what is read from these: joints, lists of pictures."""

from __future__ import annotations

import argparse
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from inspect import cleandoc
from pathlib import Path
from typing import TYPE_CHECKING, Any

from relmodel.errors import InputError, UsageError
from relmodel.names import read_csv

if TYPE_CHECKING:
    from relmodel.arrays import Floats
    from relmodel.store import Store


Option = Callable[[argparse._ActionsContainer], object]


@dataclass(frozen=True)
class Verb:
    """A verb: what it does in words, calls of it, its options, and the function that does it and returns the status."""

    words: str
    example: str
    options: Sequence[Option]
    run: Callable[[argparse.Namespace], int]


VERBS: dict[str, Verb] = {}
"""the verbs of the modules imported so far"""


def verb(example: str, *options: Option) -> Callable[[Callable[[argparse.Namespace], int]], object]:
    """Declare the function below as the verb of its name: its docstring is the help."""

    def declare(run: Callable[[argparse.Namespace], int]) -> object:
        VERBS[run.__name__.rstrip("_")] = Verb(cleandoc(run.__doc__ or ""), example, options, run)
        return run

    return declare


def option(*names: str, **how: Any) -> Option:
    """An option or argument, declared as `argparse` adds it."""
    return lambda parser: parser.add_argument(*names, **how)


def one_of(*options: Option, required: bool = False) -> Option:
    """Options of which a call has one at most."""

    def add(parser: argparse._ActionsContainer) -> None:
        group = parser.add_mutually_exclusive_group(required=required)
        for add_to in options:
            add_to(group)

    return add


EVERY_VERB = (
    option(
        "--store",
        metavar="FILE-or-URL",
        help="the store: a DuckDB file, or a postgresql+psycopg:// URL (default: the environment's RELMODEL_STORE)",
    ),
    option("--quiet", action="store_true", help="print only data and errors: no messages, no progress"),
    option("--debug", action="store_true", help="print the traceback of an internal error"),
)
FORMAT = option("--format", choices=("table", "json", "csv"), default="table", help="form of output (default: table)")
ALL = option("--all", action="store_true", help="print all rows and columns of the table, however long and wide")
WORLD = option("--world", metavar="NAME", help="the world, where the store has several")
VARIANT = option("--variant", default="", help="its variant, where it has several")
RUN = one_of(
    option(
        "number",
        nargs="?",
        default=argparse.SUPPRESS,  # or it would override --run
        metavar="RUN",
        help="the run: its number, or last, the newest inspection (default)",
    ),
    option("--run", dest="number", metavar="RUN", help="the same as RUN"),
)
NO_KEEP_IMAGES = option("--no-keep-images", action="store_true", help="do not keep the bytes of images in the store")
SEARCH = option(
    "--search", default="dual_ascent", metavar="SEARCH", help="dual_ascent (default) or paper: docs/matching.md"
)
CARRIER = option("--on", metavar="OBJECT", help="the object that carries the rig, where several do")
JOINTS = option(
    "--set",
    action="append",
    default=[],
    metavar="JOINT=VALUE",
    help="a joint's value other than the world's: mm, rad, or degrees where the name ends in _deg",
)


def joint_sigmas(words: str) -> Option:
    """`--joint-sigma`: how exactly joints are known."""
    return option("--joint-sigma", action="append", default=[], metavar="JOINT=SIGMA", help=words)


def pictures(words: str) -> Option:
    """`CAMERA=PICTURE`, as often as there are pictures: `pictures_by_camera` reads them."""
    return option("pictures", nargs="*", metavar="CAMERA=PICTURE", help=words)


def store_target(args: argparse.Namespace) -> str:
    """The store that the call names.  Raises UsageError where neither the option nor the environment does."""
    target = args.store or os.environ.get("RELMODEL_STORE")
    if not target:
        raise UsageError("no store is named: give --store FILE-or-URL or set RELMODEL_STORE")
    return str(target)


def open_store(args: argparse.Namespace, *, read_only: bool = False) -> Store:
    """The store that the call names."""
    from relmodel.store import Store

    return Store.open(store_target(args), read_only=read_only)


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


def assigned(texts: list[str], option: str) -> dict[str, float]:
    """Numbers by name, of texts NAME=NUMBER.  Raises UsageError that names the option."""
    out = {}
    for text in texts:
        name, _, value = text.rpartition("=")
        try:
            out[name] = float(value)
        except ValueError:
            name = ""
        if not name:
            raise UsageError(f"{option} {text} is not JOINT=VALUE: give a name, an equals sign and a number")
    return out


def base_covariance(sigma_mm: float, sigma_deg: float) -> Floats:
    """Covariance (6, 6) of a base, t mm then r rad, from one standard deviation along and about each axis."""
    import numpy as np

    return np.diag(np.repeat([sigma_mm**2, np.radians(sigma_deg) ** 2], 3))


# A list of pictures to inspect, a line for those taken together: CSV as a spreadsheet writes it.

FILES = ("prior", "rig", "overlay", "crops")
COLUMNS = (*FILES, "serial")  # all others are cameras
# From what is right to what is worst.
_STATUSES = (0, 5, 1, 3, 2, 4)


@dataclass(frozen=True)
class ListLine:
    """A line of a list: pictures by camera, other paths by column, None where the cell is empty, what the line is
    called, the number of the physical part, and where it stands: `FILE, line N`."""

    pictures: dict[str, Path]
    paths: dict[str, Any]
    name: str
    serial: str | None
    place: str


def read_pairs(file: Path, serial: str | None = None, **given: Path | None) -> list[ListLine]:
    """The lines of a list, whose first names its columns, some of COLUMNS and cameras; paths are relative to the list's
    folder; `serial` and the paths `given` stand for empty cells.  Raises InputError, which names the line, where it is
    no such list."""
    rows = read_csv(file, "list of pictures")
    names = [name.lower() if name.lower() in COLUMNS else name for name in next(rows, ("", []))[1]]
    _check_columns(names, file)
    pairs = [_listed(dict(zip(names, cells, strict=False)), place, file.parent, serial, given) for place, cells in rows]
    if not pairs:
        raise InputError(f"the list {file} names no picture: give a line for those taken together, below the header")
    return pairs


def worst(statuses: Iterable[int]) -> int:
    """The worst of exit statuses: an internal error, wrong use, bad input, refused or ambiguous, not as modelled."""
    return max(statuses, key=_STATUSES.index, default=0)


def _check_columns(names: Sequence[str], file: Path) -> None:
    known = f"name cameras, and where needed {', '.join(COLUMNS)}"
    if "" in names:
        raise InputError(f"{file}, line 1: a column has no name: {known}")
    twice = next((name for name in names if names.count(name) > 1), None)
    if twice is not None:
        raise InputError(f"{file}, line 1: the column {twice!r} stands there twice: {known}")
    if not set(names) - set(COLUMNS):
        raise InputError(f"{file}, line 1: there is no column of a camera: {known}")


def _listed(
    cells: dict[str, str], place: str, folder: Path, serial: str | None, given: dict[str, Path | None]
) -> ListLine:
    paths = {name: folder / cells[name] if cells.get(name) else given.get(name) for name in FILES}
    pictures = {name: folder / cell for name, cell in cells.items() if name not in COLUMNS and cell}
    if not pictures:
        raise InputError(f"{place}: no picture is named: name one under its camera, or take the line out")
    if paths["rig"] is None:
        raise InputError(f"{place}: no rig is named: give --rig, or a column rig")
    name = next(cells[camera] for camera in pictures)
    return ListLine(pictures, paths, name, cells.get("serial") or serial, place)
