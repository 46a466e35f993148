"""Reading in a child process under limits of time and memory.

    python -m relmodel.readers.child  < (path, options), pickled

The result, a model or the sentence of a refusal, goes through a file without a name: nothing of it is left whichever
process is killed.  A child ends with its parent, and at its time limit at the latest."""

from __future__ import annotations

import ctypes
import gc
import os
import pickle
import resource
import signal
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.errors import InputError, missing_library
from relmodel.readers import ReadOptions, read

if TYPE_CHECKING:
    from relmodel.model.model import Model

_PR_SET_PDEATHSIG = 1  # <sys/prctl.h>
_GIB = 1 << 30


def read_in_child(path: Path, options: ReadOptions) -> Model:
    """Have a child process read a file.  Raises InputError where it is refused, crashes or exceeds a limit."""
    root = Path(__file__).resolve().parents[2]
    with tempfile.TemporaryFile(prefix="relmodel-") as result:
        command = [sys.executable, "-m", "relmodel.readers.child", str(result.fileno()), str(os.getpid())]
        try:
            done = subprocess.run(
                command,
                cwd=root,
                env=os.environ | {"OPENBLAS_NUM_THREADS": "1"},  # its products are small, and each thread takes memory
                input=pickle.dumps((path.resolve(), path, options)),
                stdout=subprocess.DEVNULL,  # the CAD kernel prints there
                stderr=subprocess.PIPE,
                pass_fds=(result.fileno(),),
                timeout=options.time_limit_s,
                check=False,
            )
        except subprocess.TimeoutExpired as error:
            raise _too_long(path, options) from error
        result.seek(0, os.SEEK_END)
        if done.returncode == 0 and result.tell():
            result.seek(0)
            found = pickle.load(result)
            if isinstance(found, str):
                raise InputError(found)
            model: Model = found
            return model
    if done.returncode == -signal.SIGINT:  # a terminal sends it to the child too, which may be gone first
        raise KeyboardInterrupt
    if done.returncode == -signal.SIGALRM:
        raise _too_long(path, options)
    if done.returncode < 0:
        raise InputError(
            f"the process that read {path} crashed ({signal.Signals(-done.returncode).name}): export it again, "
            f"or split it where it takes more than {options.memory_limit / _GIB:.3g} GB of memory"
        )
    last = done.stderr.decode(errors="replace").strip().splitlines()
    if last and last[-1].startswith("MemoryError"):
        raise InputError(_too_much(path, options))
    raise InputError(f"{path} could not be read ({last[-1] if last else 'no reason given'}): export it again")


def _too_long(path: Path, options: ReadOptions) -> InputError:
    return InputError(
        f"reading {path} took more than {options.time_limit_s:g} s and was stopped: split the assembly, "
        "or repair the file"
    )


def _too_much(path: Path, options: ReadOptions) -> str:
    return f"reading {path} takes more than {options.memory_limit / _GIB:.3g} GB of memory: split the file"


def main(arguments: list[str]) -> int:
    result, parent = map(int, arguments)
    path, named, options = pickle.loads(sys.stdin.buffer.read())
    _limit(options, parent)
    gc.disable()  # a process this short leaves little, and millions of small objects would be gone through for it
    try:
        found: Model | str = read(path, options, in_child=False)
    except InputError as error:
        found = str(error).replace(str(path), str(named))
    except MemoryError:
        found = _too_much(named, options)
    except (ImportError, OSError) as error:
        if (missing := missing_library(error)) is None:
            raise
        found = f"{named} cannot be read: {missing}"
    with os.fdopen(result, "wb") as file:
        pickle.dump(found, file, protocol=5)
    return 0


def _limit(options: ReadOptions, parent: int) -> None:
    """Bound this process: in memory, in time, and by the life of its parent."""
    resource.setrlimit(resource.RLIMIT_AS, (options.memory_limit, options.memory_limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # an interrupt does not wait for the kernel to come back
    signal.signal(signal.SIGALRM, signal.SIG_DFL)
    signal.setitimer(signal.ITIMER_REAL, options.time_limit_s + 1.0)
    if sys.platform == "linux":
        ctypes.CDLL(None).prctl(_PR_SET_PDEATHSIG, signal.SIGKILL)
        if os.getppid() != parent:  # it was gone before
            sys.exit("the parent process has ended")


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
