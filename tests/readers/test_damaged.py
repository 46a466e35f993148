"""Damaged STEP files, and a child process that fails: one sentence each, and the store as it was."""

from __future__ import annotations

import os
import re
import shutil
from pathlib import Path

import pytest

from relmodel.errors import InputError
from relmodel.loading.load import load
from relmodel.readers.step import part21
from relmodel.readers.step.read import read_step
from relmodel.store import Store
from tests.readers.damage import KINDS, damaged, load_damaged

pytestmark = pytest.mark.usefixtures("read_by_child")

SAMPLE = ("cube-in.step", "as1-tu-203.stp", "io1-tu-203.stp")


@pytest.mark.data
@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("name", SAMPLE)
def test_a_damaged_file_is_refused_or_sound(
    data_dir: Path, duckdb_template: Path, tmp_path: Path, name: str, kind: str
) -> None:
    """`benchmarks/damaged_files.py` does the same for many more."""
    shutil.copy(duckdb_template, tmp_path / "store.duckdb")
    text = (data_dir / "step" / name).read_bytes()
    with Store.open(tmp_path / "store.duckdb") as store:
        for seed in range(2):
            copy = tmp_path / f"{seed}-{name}"
            copy.write_bytes(damaged(text, kind, seed))
            got = load_damaged(store, copy, allow_partial=False, time_limit_s=30)
            assert got.outcome != "other", got
            assert not got.faults, got


@pytest.mark.data
def test_files_that_parsers_trip_over_are_refused(data_dir: Path, duckdb_template: Path, tmp_path: Path) -> None:
    shutil.copy(duckdb_template, tmp_path / "store.duckdb")
    with Store.open(tmp_path / "store.duckdb") as store:
        for file in sorted((data_dir / "damaged").iterdir()):
            got = load_damaged(store, file, allow_partial=False, time_limit_s=30)
            assert got.outcome in ("before the kernel", "kernel failed", "child killed"), (file.name, got)
            assert not got.faults, got


@pytest.mark.data
def test_equal_seeds_damage_equally(data_dir: Path) -> None:
    text = (data_dir / "step" / "cube-in.step").read_bytes()
    for kind in KINDS:
        assert damaged(text, kind, 1) == damaged(text, kind, 1) != damaged(text, kind, 2)


def altered(path: Path, pattern: str, new: str, to: Path) -> Path:
    """A copy of a file with the first match of a pattern replaced."""
    text, count = re.subn(pattern, new, path.read_text("latin-1"), count=1)
    assert count == 1
    to.write_text(text, "latin-1")
    return to


@pytest.mark.data
@pytest.mark.parametrize(
    ("pattern", "new", "said"),
    [
        (r"#12 *=", "#999999=", r"it refers to #12, which it does not hold"),
        (r"#12 *=", "#12=NIL();#12=", r"it defines #12 more than once"),
        (
            r"#\d+ *= *CONTEXT_DEPENDENT_SHAPE_REPRESENTATION[^;]*;",
            "",
            "it does not say where 1 of 13 components stand",
        ),
    ],
)
def test_damage_that_the_text_shows(data_dir: Path, tmp_path: Path, pattern: str, new: str, said: str) -> None:
    whole = data_dir / "step" / "as1-tu-203.stp"
    assert part21.summarise(whole).damage is None
    damaged = altered(whole, pattern, new, tmp_path / "damaged.step")
    assert part21.summarise(damaged).damage == said
    with pytest.raises(InputError, match=f"{said}: export it again, or take it as it is with --allow-partial"):
        read_step(damaged)


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "pattern", "new", "said"),
    [
        (
            "cube-in.step",
            r"(#46 = CARTESIAN_POINT\('',\(0\.,0\.,)39",
            r"\g<1>38",
            "the boundary of a face gapes by 25.4 mm",
        ),
        ("cube-in.step", r"(#55 = CARTESIAN_POINT\('',\()0", r"\g<1>8", "an edge leaves its surface by 203 mm"),
        (
            "io1-tu-203.stp",
            r"VOLUME_MEASURE\(78177",
            "VOLUME_MEASURE(79177",
            "it says that the volume of 'io1' is 79177.8 mm3, and it is 78179.6",
        ),
    ],
)
def test_what_contradicts_itself_loads_only_when_asked(
    data_dir: Path, duckdb_template: Path, tmp_path: Path, name: str, pattern: str, new: str, said: str
) -> None:
    file = altered(data_dir / "step" / name, pattern, new, tmp_path / name)
    shutil.copy(duckdb_template, tmp_path / "store.duckdb")
    with Store.open(tmp_path / "store.duckdb") as store:
        if name == "io1-tu-203.stp":
            with pytest.raises(InputError, match=said):
                load(store, file, name="part")
        report = load(store, file, name="part", allow_partial=True)
    assert (report.status, report.message) == ("partial", f"the file is damaged, for {said}")


# A kernel that fails as the true one does: in place of it a module of its name in the child's path.
FAILURES = [
    ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", r"kernel crashed on .*\(SIGSEGV\): export it again"),
    ("import os; os.abort()", r"kernel crashed on .*\(SIGABRT\): export it again"),
    ("raise MemoryError", r"takes more than 6 GB of memory: split the assembly"),
    ("raise ImportError('libGL.so.1: no such file')", r"kernel does not start \(libGL\.so\.1.*install it again"),
    ("raise ModuleNotFoundError('none', name='OCP')", r"not installed: pip install 'relmodel\[step\]'"),
    ("raise RuntimeError('lost its way')", r"could not be read \(RuntimeError: lost its way\): export it again"),
    ("print('#' * 10**6); import sys; sys.exit('enough')", r"could not be read \(enough\): export it again"),
]
CUBE = (
    "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=ADVANCED_FACE('',(#2),#3,.T.);\n#2=NIL();\n#3=NIL();\n"
    "ENDSEC;\nEND-ISO-10303-21;\n"
)


@pytest.mark.parametrize(("kernel", "said"), FAILURES)
def test_how_the_child_fails_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kernel: str, said: str) -> None:
    (tmp_path / "OCP.py").write_text(kernel)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    path = tmp_path / "face.step"
    path.write_text(CUBE)
    with pytest.raises(InputError) as error:
        read_step(path)
    assert re.search(said, str(error.value))
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


def test_a_child_that_hangs_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "OCP.py").write_text("import time; time.sleep(60)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    path = tmp_path / "face.step"
    path.write_text(CUBE)
    with pytest.raises(InputError, match=r"more than 0\.5 s and was stopped"):
        read_step(path, time_limit_s=0.5)


@pytest.mark.data
def test_a_child_is_held_to_its_memory(data_dir: Path) -> None:
    """Of the address space that the kernel needs to start, none is left for a file."""
    path = data_dir / "step" / "nist_ctc_01_asme1_ap203.stp"
    with pytest.raises(InputError, match=r"memory"):
        read_step(path, memory_limit=200 << 20)
    assert read_step(path, memory_limit=2 << 30).faces_loaded == 139
