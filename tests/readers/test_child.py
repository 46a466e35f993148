"""The child process that reads: held to its limits, gone with its parent, nothing left behind; how it fails is said."""

from __future__ import annotations

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path

import pytest
import trimesh

from relmodel.errors import InputError
from relmodel.readers import ReadOptions, read

ROOT = Path(__file__).parents[2]
FACE = (
    "ISO-10303-21;\nHEADER;\nENDSEC;\nDATA;\n#1=ADVANCED_FACE('',(#2),#3,.T.);\n#2=NIL();\n#3=NIL();\n"
    "ENDSEC;\nEND-ISO-10303-21;\n"
)


def test_a_mesh_read_by_a_child_is_the_one_read_here(tmp_path: Path) -> None:
    trimesh.creation.box((30, 20, 10)).export(tmp_path / "box.stl")
    options = ReadOptions(unit="mm", name="block")
    here, there = (read(tmp_path / "box.stl", options, in_child=child) for child in (False, True))
    assert there.parts == here.parts
    assert (there.files, there.unit, there.faces_loaded) == (here.files, "mm", 6)
    assert there.shapes[0].volume == here.shapes[0].volume == pytest.approx(6000)


def test_a_child_ends_with_its_parent_and_leaves_nothing(tmp_path: Path) -> None:
    stub, scratch = tmp_path / "stub", tmp_path / "scratch"
    stub.mkdir()
    scratch.mkdir()
    told = tmp_path / "child.pid"
    (stub / "OCP.py").write_text(f"import os, time\nopen({str(told)!r}, 'w').write(str(os.getpid()))\ntime.sleep(60)\n")
    path = tmp_path / "face.step"
    path.write_text(FACE)
    program = f"from pathlib import Path\nfrom relmodel.readers import read\nread(Path({str(path)!r}))\n"
    environment = os.environ | {"PYTHONPATH": f"{stub}{os.pathsep}{ROOT}", "TMPDIR": str(scratch)}
    parent = subprocess.Popen([sys.executable, "-c", program], cwd=ROOT, env=environment)
    assert _until(lambda: told.exists() and told.read_text() != "")
    child = int(told.read_text())
    parent.send_signal(signal.SIGKILL)
    parent.wait()
    assert _until(lambda: not _lives(child))
    assert list(scratch.iterdir()) == []


def _until(holds: object, seconds: float = 60.0) -> bool:
    """Whether something comes to hold; how soon is not asked."""
    assert callable(holds)
    end = time.monotonic() + seconds
    while not (found := bool(holds())) and time.monotonic() < end:
        time.sleep(0.05)
    return found


def _lives(process: int) -> bool:
    try:
        state = Path(f"/proc/{process}/stat").read_text().rpartition(")")[2].split()[0]
    except OSError:
        return False
    return state != "Z"


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


@pytest.mark.parametrize(("kernel", "said"), FAILURES)
def test_how_the_child_fails_is_said(tmp_path: Path, monkeypatch: pytest.MonkeyPatch, kernel: str, said: str) -> None:
    (tmp_path / "OCP.py").write_text(kernel)
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    path = tmp_path / "face.step"
    path.write_text(FACE)
    with pytest.raises(InputError) as error:
        read(path)
    assert re.search(said, str(error.value))
    assert "\n" not in str(error.value)
    assert str(path) in str(error.value)


def test_a_child_that_hangs_is_stopped(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "OCP.py").write_text("import time; time.sleep(60)")
    monkeypatch.setenv("PYTHONPATH", str(tmp_path), prepend=os.pathsep)
    path = tmp_path / "face.step"
    path.write_text(FACE)
    with pytest.raises(InputError, match=r"more than 0\.5 s and was stopped"):
        read(path, ReadOptions(time_limit_s=0.5))


@pytest.mark.data
def test_a_child_is_held_to_its_memory(data_dir: Path) -> None:
    """Of the address space that the kernel needs to start, none is left for a file."""
    path = data_dir / "step" / "cube-in.step"
    with pytest.raises(InputError, match=r"memory"):
        read(path, ReadOptions(memory_limit=200 << 20))
