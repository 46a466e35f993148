"""Readers of model files: STEP, meshes and URDF, each returning a frozen `Model`.

`read` is the one way in.  What it needs is imported when it is called, and in the child process where there is one."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from relmodel.model.model import Model

TIME_LIMIT_S = 300.0
MEMORY_LIMIT = 6 << 30


@dataclass(frozen=True)
class ReadOptions:
    """unit: of the lengths of a mesh that states none.  name: of a mesh that has none in its file (default: the
    file's).  time_limit_s, memory_limit (bytes): of the child process that reads.
    occluder: whether a mesh only occludes, and stays triangles between crease edges."""

    unit: str | None = None
    name: str | None = None
    time_limit_s: float = TIME_LIMIT_S
    occluder: bool = False
    memory_limit: int = MEMORY_LIMIT


DEFAULTS = ReadOptions()
Reader = Callable[[Path, ReadOptions], "Model"]


def read(path: Path, options: ReadOptions = DEFAULTS, *, in_child: bool = True) -> Model:
    """Read a STEP, mesh or URDF file and validate it; lengths become mm.

    By default a child process reads, under limits of time and memory: parsers of foreign bytes crash, hang and take
    what memory they want.  Raises InputError where the file cannot be read, holds nothing, gives numbers that are not
    finite, or exceeds a limit."""
    from relmodel.errors import InputError
    from relmodel.names import check_readable

    check_readable(path)
    if in_child:
        from relmodel.readers.child import read_in_child

        return read_in_child(path, options)
    from relmodel.model.validation import is_finite, validated
    from relmodel.readers.formats import format_of

    form = format_of(path)
    if form == "step":
        from relmodel.readers.step.read import read_step

        model = read_step(path)
    elif form == "urdf":
        from relmodel.readers.urdf import read_urdf

        model = read_urdf(path)
    else:
        from relmodel.readers.mesh.read import read_mesh

        model = read_mesh(path, options.unit, name=options.name, fit=not options.occluder)
    if not is_finite(model):
        raise InputError(f"{path} has sizes or positions that are not finite: export it again")
    return validated(model)
