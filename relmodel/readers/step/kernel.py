"""The child process of `read.py`: reads one STEP file with the CAD kernel and pickles a LoadedModel, or a message.

    python -m relmodel.readers.step.kernel IN OUT BYTES

Runs under a memory limit that it sets itself; may crash, and then leaves nothing.
"""

from __future__ import annotations

import gc
import pickle
import resource
import signal
import sys
from pathlib import Path
from typing import Any


def main(arguments: list[str]) -> int:
    source, out, limit = arguments[0], arguments[1], int(arguments[2])
    resource.setrlimit(resource.RLIMIT_AS, (limit, limit))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    signal.signal(signal.SIGINT, signal.SIG_DFL)  # an interrupt does not wait for the kernel to come back
    gc.disable()  # a process this short leaves little, and millions of small objects would be gone through for it
    try:
        _write(_read(source), out)
    except MemoryError:
        _write(f"reading {{path}} takes more than {limit / (1 << 30):.3g} GB of memory: split the assembly", out)
    return 0


def _write(result: Any, out: str) -> None:
    with Path(out).open("wb") as file:
        pickle.dump(result, file, protocol=5)


def _read(source: str) -> Any:
    try:
        from relmodel.readers.step import document as step_document
        from relmodel.readers.step import tessellated as step_tessellated
    except ModuleNotFoundError as error:
        if error.name != "OCP":
            raise
        return "{path} cannot be read without the CAD kernel, which is not installed: pip install 'relmodel[step]'"
    except ImportError as error:
        return f"{{path}} cannot be read, for the CAD kernel does not start ({error}): free memory, or install it again"
    try:
        return step_document.read(source)
    except step_document.UnknownUnitError as error:
        named = f"an unknown unit of length, {error}" if str(error) else "no known unit of length"
        return f"{{path}} is in {named}: export it in one such as the millimetre"
    except step_tessellated.NoAreaError:
        return "{path} holds triangles without any area only: export it again"
    except step_document.UnreadableError as error:
        return f"{{path}} could not be read ({error}): export it again"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
