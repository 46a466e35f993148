"""How numeric kernels are compiled: one decorator, explicit signatures, kept on disk under a key of all kernels' text.

A kernel module is called NAME_kernels.py, holds kernels and what they share, and is imported only by the functions
that run them: importing it loads numba and compiles its kernels, or loads them from the cache.

    from relmodel.compiled import helper, kernel

    @helper                                  # called by kernels only, typed and compiled with each of them
    def _square(x: float) -> float: ...

    @kernel("f8[::1](f8[:, ::1], i8)")       # numba's notation: result, then parameters, C-contiguous arrays
    def sums(rows: Floats, first: int) -> Floats: ...

Most of compiling is type inference, so the least code compiles fastest: plain loops over arrays handed in.  A trivial
kernel costs .04 s of the processor, `np.empty` .05 to .1, `np.zeros` and `np.full` .2 each, arithmetic next to nothing;
assigning a slice costs 2 s, `parallel=True` 2 s and more.  Arrays are made in Python and handed in; threads are
Python's, whom a running kernel does not hinder.  No fast maths and no parallel sums: equal input gives equal bits.

Numba's own cache does not see that a kernel changed which another module's kernel calls.  So the folder of the cache
bears a hash of all kernel modules, of the versions that compile them and of the processor: what lies in one folder
never changes, and processes that write it at once write the same."""

from __future__ import annotations

import fcntl
import gc
import hashlib
import os
import shutil
import sys
import threading
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import ExitStack, contextmanager, suppress
from functools import cache
from importlib import import_module
from pathlib import Path
from pickle import UnpicklingError
from subprocess import DEVNULL, PIPE, Popen
from typing import Any, TypeVar, cast

import llvmlite
import numba
from llvmlite import binding

Function = TypeVar("Function", bound=Callable[..., object])

# Nobody calls these from C: a wrapper for that would be compiled for nothing.
_OPTIONS: dict[str, Any] = {"error_model": "numpy", "boundscheck": False, "nogil": True, "no_cfunc_wrapper": True}

_njit: Any = numba.njit
_config: Any = numba.config
_PACKAGES = ("relmodel", "vision")
_PROCESSES = 8  # at most: each takes some 300 MB
_KEPT = 8  # folders of earlier kernels kept besides the one in use
_configuring = threading.Lock()


def kernel(signature: str) -> Callable[[Function], Function]:
    """Decorator: compile for `signature` when the module is imported, or load from the cache."""

    def compiled(function: Function) -> Function:
        if cache_folder() is not None:
            with suppress(OSError, EOFError, UnpicklingError), _cached_here():  # full, read-only, or torn
                return cast(Function, _njit(signature, cache=True, **_OPTIONS)(function))
        return cast(Function, _njit(signature, **_OPTIONS)(function))

    return compiled


def helper(function: Function) -> Function:
    """Decorator of what only kernels call: compiled into the first that is, and never loaded by itself."""
    return cast(Function, _njit(no_cpython_wrapper=True, **_OPTIONS)(function))


def compile_ahead(modules: Sequence[str], say: Callable[[str], None]) -> None:
    """Compile the kernels of these modules, where they are not in the cache yet, in as many processes as there are
    processors, and say so.  What is not compiled so, for whatever reason, is when its module is imported."""
    folder = cache_folder()
    if folder is None:
        say("compiling kernels for this process only: there is no folder to keep them (name one in NUMBA_CACHE_DIR)")
        return
    missing = [module for module in modules if not _mark(folder, module).exists()]
    if not missing:
        return
    say(f"compiling kernels, once for this version, to be kept in {folder} ...")
    with ExitStack() as turn:  # another process that compiles has all processors at work, and leaves less to do
        with suppress(OSError):  # a folder that can only be read
            fcntl.flock(turn.enter_context((folder / "turn").open("w")), fcntl.LOCK_EX)
        _compile([module for module in missing if not _mark(folder, module).exists()])


def _compile(missing: Sequence[str]) -> None:
    if not missing:
        return
    # The longest first, so that no process is left with one while the others have nothing more to do.
    waiting = sorted(missing, key=lambda module: -_source(module).stat().st_size)
    processors = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    turn = iter(waiting)  # `next` of it is whole: threads share it

    def work(_: int) -> None:
        command = [sys.executable, "-c", f"from {__name__} import _serve; _serve()"]
        with suppress(OSError), Popen(command, stdin=PIPE, stdout=PIPE, stderr=DEVNULL, text=True) as process:
            assert process.stdin is not None
            assert process.stdout is not None
            for module in turn:
                print(module, file=process.stdin, flush=True)
                if not process.stdout.readline():
                    break

    with ThreadPoolExecutor(min(processors, len(missing), _PROCESSES)) as pool:
        list(pool.map(work, range(min(processors, len(missing), _PROCESSES))))


def _serve() -> None:
    """Import the modules named on stdin, whose kernels are compiled thereby, and mark them: the child process."""
    gc.disable()  # compiling leaves much behind, and the process ends soon
    folder = cache_folder()
    for line in sys.stdin:
        module = line.strip()
        import_module(module)
        if folder is not None:
            _mark(folder, module).touch()
        print(module, flush=True)


def _mark(folder: Path, module: str) -> Path:
    """Exists where all kernels of a module are in the cache."""
    return folder / f"{module}.compiled"


def _source(module: str) -> Path:
    return Path(__file__).parent.parent / f"{module.replace('.', '/')}.py"


@cache
def cache_folder() -> Path | None:
    """Where the compiled kernels of this installation lie, in the user's cache or under NUMBA_CACHE_DIR; None where it
    cannot be made, and each process compiles for itself.  One that is complete need not be writable."""
    try:
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "relmodel"
        folder = Path(os.environ.get("NUMBA_CACHE_DIR") or base) / f"kernels-{cache_key()[:16]}"
        if not folder.is_dir():
            folder.mkdir(parents=True, exist_ok=True)
            with suppress(OSError):  # another process removes them too
                earlier = [other for other in folder.parent.glob("kernels-*") if other != folder]
                for other in sorted(earlier, key=lambda other: other.stat().st_mtime)[:-_KEPT]:
                    shutil.rmtree(other, ignore_errors=True)
    except (OSError, RuntimeError):  # a read-only disk; nobody's home
        return None
    return folder


@cache
def cache_key() -> str:
    """Hash of what the code of kernels depends on: the text of all kernel modules and of this one, the versions of
    Python, numba and LLVM, and the processor."""
    digest = hashlib.sha256()
    top = Path(__file__).parent.parent
    sources = [file for package in _PACKAGES for file in sorted((top / package).rglob("*kernels.py"))]
    for file in (Path(__file__), *sources):
        digest.update(f"{file.relative_to(top).as_posix()}\n".encode())
        digest.update(hashlib.sha256(file.read_bytes()).digest())
    processor = _config.CPU_NAME or binding.get_host_cpu_name(), _config.CPU_FEATURES, _config.OPT
    features = binding.get_host_cpu_features().flatten()
    versions = sys.implementation.cache_tag, numba.__version__, llvmlite.__version__, binding.get_default_triple()
    digest.update(repr((versions, processor, features)).encode())
    return digest.hexdigest()


@contextmanager
def _cached_here() -> Iterator[None]:
    """Numba asks for the place of a cache when it makes a function's: while the block lasts, that is `_Place`."""
    with _configuring:
        others = _config.CACHE_LOCATOR_CLASSES
        _config.CACHE_LOCATOR_CLASSES = f"{__name__}.{_Place.__name__}"
        try:
            yield
        finally:
            _config.CACHE_LOCATOR_CLASSES = others


class _Place:
    """Where numba keeps a function: in one folder for all, whose name stands for all they depend on."""

    def __init__(self, function: Callable[..., object]) -> None:
        self._module = function.__module__

    @classmethod
    def from_function(cls, function: Callable[..., object], _file: str) -> _Place:
        return cls(function)

    def get_cache_path(self) -> str:
        return str(cache_folder())

    def ensure_cache_path(self) -> None:
        """Made when the folder was asked for."""

    def get_source_stamp(self) -> str:
        return cache_key()

    def get_disambiguator(self) -> str:
        return self._module
