"""Linear algebra runs in one thread while an inspection lasts, also by what is loaded only then, and then as before."""

from __future__ import annotations

import os
import subprocess
import sys
from pathlib import Path

# Asks the copies of NumPy and SciPy where their wheels keep them.
SCRIPT = """
import ctypes, sys
from pathlib import Path
import numpy
from relmodel.store import Store

def threads(package, suffix):
    (file,) = Path(numpy.__file__).parents[1].glob(f"{package}.libs/libscipy_openblas*")
    return getattr(ctypes.CDLL(str(file)), "scipy_openblas_get_num_threads" + suffix)()

print(threads("numpy", "64_"))
with Store.open(sys.argv[1], read_only=True) as store:
    with store.one_thread():
        import scipy.linalg
        with store.one_thread():
            pass
        print(threads("numpy", "64_"), threads("scipy", ""))
    print(threads("numpy", "64_"), threads("scipy", ""))
    try:
        with store.one_thread():
            raise OSError
    except OSError:
        print(threads("numpy", "64_"), threads("scipy", ""))
"""


def test_one_thread_is_one_for_linear_algebra_too_and_only_while_it_lasts(duckdb_file: Path) -> None:
    environment = os.environ | {"OPENBLAS_NUM_THREADS": "2"}
    command = [sys.executable, "-c", SCRIPT, str(duckdb_file)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True, check=True)
    before, *after = done.stdout.split()
    assert after == ["1", "1", *[before] * 4]  # before: 2, unless there is one processor only
