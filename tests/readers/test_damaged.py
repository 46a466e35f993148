"""Damaged STEP files, and a child process that fails: one sentence each, and the store as it was."""

from __future__ import annotations

import os
import re
from collections import Counter
from pathlib import Path

import pytest

from relmodel.errors import InputError
from relmodel.readers import ReadOptions, read
from relmodel.readers.step import part21
from relmodel.readers.step.part21 import Instances
from relmodel.store import Store
from tests.readers.damage import damaged, load_damaged
from tests.reading import load

# Of each kind one, which come to different ends.
DAMAGED = (
    ("cube-in.step", "truncation", 0),
    ("conical-surface.step", "byte flips", 0),
    ("cube-in.step", "dropped lines", 1),
    ("cube-in.step", "digit noise", 0),
)


@pytest.mark.data
def test_a_damaged_file_is_refused_or_sound(data_dir: Path, duckdb_file: Path, tmp_path: Path) -> None:
    """What is refused for lost faces is loaded again as with --allow-partial."""
    outcomes = []
    with Store.open(duckdb_file) as store:
        for name, kind, seed in DAMAGED:
            copy = tmp_path / name
            copy.write_bytes(damaged((data_dir / "step" / name).read_bytes(), kind, seed))
            for partly in (False, True):
                got = load_damaged(store, copy, allow_partial=partly, time_limit_s=30)
                outcomes.append(got.outcome)
                assert got.outcome != "other", got
                assert not got.faults, got
                if got.outcome != "lost faces":
                    break
    assert len(set(outcomes)) > 3


@pytest.mark.data
def test_files_that_parsers_trip_over_are_refused(data_dir: Path, duckdb_file: Path) -> None:
    """One whose text shows it and one that only the kernel finds."""
    with Store.open(duckdb_file) as store:
        for name in ("select_segfault_2.stp", "advanced-face-inline-cylinder-malformed.step"):
            got = load_damaged(store, data_dir / "damaged" / name, allow_partial=False, time_limit_s=30)
            assert got.outcome in ("before the kernel", "kernel failed", "child killed"), (name, got)
            assert not got.faults, got


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
        (r"#12 *=", "#999999=", "refers to #12, which it does not hold"),
        (r"#12 *=", "#12=NIL();#12=", "defines #12 more than once"),
        (r"#\d+ *= *CONTEXT_DEPENDENT_SHAPE_REPRESENTATION[^;]*;", "", "does not place 1 of 13 components"),
    ],
)
def test_damage_that_the_text_shows(data_dir: Path, tmp_path: Path, pattern: str, new: str, said: str) -> None:
    whole = data_dir / "step" / "as1-tu-203.stp"
    assert part21.damage(Instances(whole.read_bytes())) == ()
    damaged = altered(whole, pattern, new, tmp_path / "damaged.step")
    (finding,) = part21.damage(Instances(damaged.read_bytes()))
    assert (finding.kind, finding.message) == ("damaged_text", f"the file {said}")


@pytest.mark.data
def test_what_contradicts_itself_loads_with_findings(data_dir: Path, duckdb_file: Path, tmp_path: Path) -> None:
    """What the kernel reads with all its faces loads; what is wrong with it are rows, and --strict refuses it."""
    whole = data_dir / "step/cube-in.step"
    file = altered(whole, r"(#55 = CARTESIAN_POINT\('',\()0", r"\g<1>8", tmp_path / "cube.step")
    with Store.open(duckdb_file) as store:
        with pytest.raises(InputError, match=r"finding.*, the first: .*without --strict"):
            load(store, file, name="part", strict=True)
        report = load(store, file, name="part")
        assert report.status == "added"
        with store.read() as connection:
            rows = connection.execute(store.table("load_finding").select()).all()
            arcs = {row.id for row in connection.execute(store.table("arc").select())}
    ours, refused = [r for r in rows if r.run_id == report.run], [r for r in rows if r.run_id != report.run]
    assert [(r.kind, r.message, r.value) for r in ours] == [(r.kind, r.message, r.value) for r in refused]
    assert dict(report.findings) == Counter(r.kind for r in ours)
    worst = max((r for r in ours if r.kind == "edge_off_face"), key=lambda r: r.value)
    assert (worst.value, worst.bound) == pytest.approx((203.2, 0.17320508), rel=1e-3)
    assert {r.arc_id for r in ours if r.kind in ("open_loop", "edge_off_face")} <= arcs


# A kernel that fails as the true one does: in place of it a module of its name in the child's path.
FAILURES = [
    ("import os, signal; os.kill(os.getpid(), signal.SIGSEGV)", r"that read .* crashed \(SIGSEGV\): export it again"),
    ("raise MemoryError", r"takes more than 6 GB of memory: split the file"),
    ("import sys; sys.exit('MemoryError')", r"takes more than 6 GB of memory: split the file"),
    ("raise ImportError('OCP is of another Python')", r"kernel does not start \(OCP is.*install it again"),
    (
        "raise ImportError('libGL.so.1: cannot open shared object file: No such file or directory')",
        r"kernel does not start: the library libGL\.so\.1 is not installed: apt install libgl1 \(Debian",
    ),
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
        read(path)
    assert re.search(said, str(error.value))
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


def test_a_child_that_hangs_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "OCP.py").write_text("import time; time.sleep(60)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    path = tmp_path / "face.step"
    path.write_text(CUBE)
    with pytest.raises(InputError, match=r"more than 0\.5 s and was stopped"):
        read(path, ReadOptions(time_limit_s=0.5))


@pytest.mark.data
def test_a_child_is_held_to_its_memory(data_dir: Path) -> None:
    """Of the address space that the kernel needs to start, none is left for a file."""
    path = data_dir / "step" / "cube-in.step"
    with pytest.raises(InputError, match=r"memory"):
        read(path, ReadOptions(memory_limit=200 << 20))
