"""Runs modules of a copy of the checkout, each in a fork of a process that has imported what they need of others.

Reads a line of JSON each from stdin: `[module, its arguments, the file that takes what it prints]`; answers the process
that runs it, then its exit status.  Importing the libraries takes longer than most of what is run."""

from __future__ import annotations

import json
import os
import runpy
import sys
from importlib import import_module

LIBRARIES = (
    "numba", "numpy", "scipy.linalg", "scipy.optimize", "scipy.sparse.linalg", "scipy.spatial", "cv2", "duckdb",
    "sqlalchemy", "duckdb_sqlalchemy", "pyarrow.compute", "shapely", "trimesh", "networkx", "yaml", "pytest",
)  # fmt: skip


def run(module: str, arguments: list[str], out: str) -> None:
    """Run a module as a program of its own and end this process."""
    os.setsid()
    file = os.open(out, os.O_WRONLY | os.O_CREAT | os.O_TRUNC)
    os.dup2(file, 1)
    os.dup2(file, 2)
    sys.argv = [module, *arguments]
    status = 1
    try:
        runpy.run_module(module, run_name="__main__", alter_sys=True)
        status = 0
    except SystemExit as end:
        status = end.code if isinstance(end.code, int) else int(end.code is not None)
        if isinstance(end.code, str):
            print(end.code)
    finally:
        sys.stdout.flush()
        os._exit(status)


def main() -> None:
    for name in LIBRARIES:
        import_module(name)
    for line in sys.stdin:
        if (process := os.fork()) == 0:
            run(*json.loads(line))
        print(process, flush=True)
        print(os.waitstatus_to_exitcode(os.waitpid(process, 0)[1]), flush=True)


if __name__ == "__main__":
    main()
