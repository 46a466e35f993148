"""The child process of `step.py`: reads one STEP file with the CAD kernel and pickles a LoadedModel, or a message.

    python -m relmodel.loading.step_kernel IN OUT

Runs under a memory limit that it sets itself; may crash, and then leaves nothing.
"""

from __future__ import annotations

import pickle
import resource
import sys
from pathlib import Path
from typing import Any

MEMORY_LIMIT = 6 << 30


def main(arguments: list[str]) -> int:
    source, out = arguments
    resource.setrlimit(resource.RLIMIT_AS, (MEMORY_LIMIT, MEMORY_LIMIT))
    resource.setrlimit(resource.RLIMIT_CORE, (0, 0))
    result: Any
    try:
        import OCP  # noqa: F401
    except ImportError:
        result = "reading STEP needs the CAD kernel: pip install 'relmodel[step]'"
    else:
        result = _read(source)
    with Path(out).open("wb") as file:
        pickle.dump(result, file, protocol=5)
    return 0


def _read(source: str) -> Any:
    from relmodel.loading import step_document

    try:
        return step_document.read(source)
    except MemoryError:
        return f"reading {{path}} takes more than {MEMORY_LIMIT >> 30} GB of memory: split the assembly"
    except step_document.UnreadableError as error:
        return f"{{path}} could not be read ({error}): export it again"


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
