"""A wheel, installed into an empty environment, is whole: it brings its SQL and runs as a checkout does."""

from __future__ import annotations

import os
import re
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import pytest

from relmodel.compiled import cache_key

CHECKOUT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(CHECKOUT)]
    subprocess.run(command, check=True, capture_output=True)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The programs of an environment into which the wheel was unpacked, as an installer does.

    What the wheel depends on is borrowed from the environment of the tests by a .pth file, which does not follow the
    .pth files there: where the checkout is installed for editing, it stays out of reach."""
    folder = tmp_path_factory.mktemp("empty")
    venv.create(folder)
    packages = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)}))
    with zipfile.ZipFile(wheel) as file:
        file.extractall(packages)
    (packages / "borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return folder / ("Scripts" if os.name == "nt" else "bin")


# The demonstration by the program that an installer makes, by the queries and the migrations that the wheel brings.
RUN = """
import os, relmodel.app.session, vision
from importlib.metadata import entry_points
from relmodel.compiled import cache_key
relmodel.app.session.compile_behind = lambda say: None  # in a process of its own: all is compiled
(program,) = entry_points(group="console_scripts", name="relmodel")
main = program.load()
ended = [main(["demo"])]
os.environ["RELMODEL_STORE"] = "demo/cell.duckdb"
ended += [main(["migrate"])]
print(relmodel.__file__, vision.__file__, cache_key(), *ended)
"""


def test_wheel_carries_data_and_two_packages_only(wheel: Path) -> None:
    names = zipfile.ZipFile(wheel).namelist()
    assert {name.partition("/")[0] for name in names if ".dist-info" not in name} == {"relmodel", "vision"}
    for folder, suffix in (("schema", "sql"), ("queries", "sql"), ("migrations", "py")):
        here = {path.relative_to(CHECKOUT).as_posix() for path in (CHECKOUT / folder).rglob(f"*.{suffix}")}
        assert here
        assert {f"relmodel/data/{name}" for name in here} <= set(names)
    assert "relmodel/data/migrations/env.py" in names
    demo = {path.name for path in (CHECKOUT / "examples" / "demo").iterdir()}
    assert {f"relmodel/data/demo/{name}" for name in demo} <= set(names)


def test_installed_wheel_runs_the_demonstration(installed: Path, tmp_path: Path) -> None:
    """In an empty folder, by its own code, whose kernels lie in the cache where those of equal text do everywhere."""
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "RELMODEL"))}
    call = [str(installed / "python"), "-c", RUN]
    done = subprocess.run(call, cwd=tmp_path, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    said = done.stdout
    assert "verdict   pose usable; part as modelled" in said
    off = re.search(r"pose +([\d.]+) mm and ([\d.]+) degrees", said)
    assert off
    assert float(off[1]) < 1
    assert float(off[2]) < 0.1
    assert (tmp_path / "demo" / "pair_00_overlay.png").stat().st_size > 10_000
    assert said.endswith(f" {cache_key()} 0 0\n")
    assert said.splitlines()[-1].count(str(installed.parent)) == 2
    assert str(CHECKOUT) not in said
