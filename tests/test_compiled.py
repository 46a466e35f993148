"""The cache of compiled kernels: keyed by what kernels say, shared by processes that start cold, and never needed."""

from __future__ import annotations

import os
import shutil
import subprocess
import sys
from importlib.util import find_spec
from pathlib import Path

import pytest

from relmodel import compiled
from relmodel.app.session import compile_behind
from vision.inspection import KERNELS

CHECKOUT = Path(__file__).parent.parent

_HELPER = """
from relmodel.compiled import helper

@helper
def scaled(x):
    return 2.0 * x
"""
_KERNEL = """
from relmodel.compiled import kernel
from relmodel.first_kernels import scaled

@kernel("void(f8[::1])")
def scale(values):
    for i in range(len(values)):
        values[i] = scaled(values[i])
"""
# Says that it is imported, which is what compiles a module of kernels.
_LOGGED = """
import os
open(os.environ["KERNEL_LOG"], "a").write("x")
"""
# Prints what the kernel makes of 0, 1, 2 and whether it came from the cache.
_USE = """
import numpy as np
from relmodel.second_kernels import scale
values = np.arange(3.0)
scale(values)
print(values.tolist(), sum(scale.stats.cache_hits.values()))
"""
_AHEAD = """
from relmodel.compiled import compile_ahead
compile_ahead([f"relmodel.{number}_kernels" for number in ("fourth", "third", "second")], print)
"""


def make_package(at: Path) -> Path:
    """A folder that holds a package `relmodel` of kernel modules, of which one calls another and one cannot be had."""
    folder = at / "code" / "relmodel"
    folder.mkdir(parents=True)
    (folder / "__init__.py").write_text("")
    (folder / "first_kernels.py").write_text(_HELPER)
    (folder / "second_kernels.py").write_text(_KERNEL)
    (folder / "third_kernels.py").write_text(_LOGGED)
    (folder / "fourth_kernels.py").write_text("raise OSError('no')")
    shutil.copy(CHECKOUT / "relmodel" / "compiled.py", folder)
    return folder.parent


@pytest.fixture
def package(tmp_path: Path) -> Path:
    return make_package(tmp_path)


@pytest.fixture(scope="module")
def filled(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A cache with old folders, in which two processes that started together left what they compiled ahead, to be
    copied; beside it what they said and what was imported."""
    folder = tmp_path_factory.mktemp("filled")
    package, cache = make_package(folder), folder / "cache"
    for number in range(12):
        (cache / f"kernels-{number}").mkdir(parents=True)
        os.utime(cache / f"kernels-{number}", (number, number))
    (cache / "another").mkdir()
    together = [started(package, cache, _AHEAD + _USE, folder / "log") for _ in range(2)]
    (folder / "said").write_text("".join(said(process) for process in together))
    return cache


@pytest.fixture
def cache(filled: Path, tmp_path: Path) -> Path:
    """A copy of that cache: equal code elsewhere has the same folder in it."""
    return shutil.copytree(filled, tmp_path / "cache")


def started(package: Path, cache: Path, code: str = _USE, log: Path = Path(os.devnull)) -> subprocess.Popen[str]:
    environment = os.environ | {"PYTHONPATH": str(package), "NUMBA_CACHE_DIR": str(cache), "KERNEL_LOG": str(log)}
    pipe = subprocess.PIPE
    return subprocess.Popen(
        [sys.executable, "-c", code], cwd=package, env=environment, stdout=pipe, stderr=pipe, text=True
    )


def said(process: subprocess.Popen[str]) -> str:
    out, err = process.communicate(timeout=300)
    assert process.returncode == 0, err
    return out


def test_a_changed_kernel_has_another_folder(package: Path, cache: Path) -> None:
    """Numba alone would go on with what the caller was compiled with.  Equal code elsewhere has the same folder."""
    before = set(cache.iterdir())
    (package / "relmodel" / "first_kernels.py").write_text(_HELPER.replace("2.0", "3.0"))
    assert said(started(package, cache)) == "[0.0, 3.0, 6.0] 0\n"
    (package / "relmodel" / "first_kernels.py").write_text(_HELPER)
    assert said(started(package, cache)) == "[0.0, 2.0, 4.0] 1\n"
    assert len(set(cache.iterdir()) - before) == 1


def test_processes_that_start_cold_together_compile_once_and_few_folders_are_kept(filled: Path) -> None:
    """What cannot be compiled stops nothing."""
    told = (filled.parent / "said").read_text()
    assert told.count("[0.0, 2.0, 4.0] 1\n") == 2
    assert "compiling kernels, once for this version" in told
    assert (filled.parent / "log").read_text() == "x"
    assert not list(filled.rglob("*.tmp.*"))
    left = {path.name for path in filled.iterdir()}
    assert {"another", *(f"kernels-{number}" for number in range(4, 12))} < left
    assert len(left) == 10


def test_kernels_run_where_nothing_can_be_written(package: Path, tmp_path: Path) -> None:
    """A file in the place of the folder stops root too, whom permissions do not."""
    cache = tmp_path / "cache"
    cache.write_text("")
    told = said(started(package, cache, _AHEAD + _USE))
    assert told.endswith("[0.0, 2.0, 4.0] 0\n")
    assert "NUMBA_CACHE_DIR" in told
    assert cache.read_text() == ""


def test_a_torn_file_is_compiled_anew(package: Path, cache: Path) -> None:
    (file,) = cache.rglob("*.nbc")
    file.write_bytes(file.read_bytes()[:20])
    assert said(started(package, cache)) == "[0.0, 2.0, 4.0] 0\n"


def test_compiling_behind_a_load_is_started_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    started_with: list[list[str]] = []
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path / "cache"))
    monkeypatch.setattr("relmodel.app.session.Popen", lambda command, **_: started_with.append(command))
    told: list[str] = []
    compile_behind(told.append)
    compile_behind(told.append)
    assert len(started_with) == len(told) == 1
    assert "compile_ahead(KERNELS" in started_with[0][2]


def test_the_kernels_of_an_inspection_are_those_of_its_packages() -> None:
    assert all(find_spec(module) for module in KERNELS)
    here = {".".join(file.relative_to(CHECKOUT).with_suffix("").parts) for file in modules("vision")}
    assert here == {kernel for kernel in KERNELS if kernel.startswith("vision.")}


def test_only_kernel_modules_hold_kernels_and_by_one_decorator() -> None:
    """Whose text the key of the cache is made of."""
    of_kernels = {*modules("relmodel"), *modules("vision")}
    for package in ("relmodel", "vision"):
        for file in (CHECKOUT / package).rglob("*.py"):
            text = file.read_text()
            assert "njit" not in text or file.name == "compiled.py" or "mesh" in file.parts, file
            assert "@kernel" not in text or file in of_kernels or file.name == "compiled.py", file


def modules(package: str) -> list[Path]:
    return [file for file in (CHECKOUT / package).rglob("*kernels.py") if file != Path(compiled.__file__)]
