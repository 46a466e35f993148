"""A wheel, installed into an empty environment, is whole: it brings its SQL and runs as a checkout does."""

from __future__ import annotations

import gzip
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from pathlib import Path

import numpy as np
import pytest
from OCP.BRepPrimAPI import BRepPrimAPI_MakeBox
from OCP.gp import gp_Pnt

from examples.render.objects import write_step
from relmodel.compiled import cache_key
from tests.app.cli.conftest import Pair, blocks_pair
from tests.vision.localisation.scenes import above, block_boxes

__all__ = ["blocks_pair"]  # a fixture

CHECKOUT = Path(__file__).parent.parent


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("wheel")
    command = [sys.executable, "-m", "build", "--wheel", "--no-isolation", "--outdir", str(folder), str(CHECKOUT)]
    subprocess.run(command, check=True, capture_output=True)
    return next(folder.glob("*.whl"))


@pytest.fixture(scope="module")
def installed(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The `relmodel` program of an environment that holds the wheel.

    What the wheel depends on is borrowed from the environment of the tests by a .pth file, which does not follow the
    .pth files there: where the checkout is installed for editing, it stays out of reach.
    """
    folder = tmp_path_factory.mktemp("empty")
    venv.create(folder)
    scripts = folder / ("Scripts" if os.name == "nt" else "bin")
    install = ["--python", str(scripts / "python"), "install", "--quiet", "--no-deps", "--no-index", str(wheel)]
    subprocess.run([sys.executable, "-m", "pip", *install], check=True, capture_output=True)
    packages = Path(sysconfig.get_path("purelib", vars={"base": str(folder), "platbase": str(folder)}))
    (packages / "borrowed.pth").write_text(sysconfig.get_path("purelib") + "\n")
    return scripts / "relmodel"


def run(program: Path, *arguments: str, folder: Path) -> str:
    environment = {name: value for name, value in os.environ.items() if not name.startswith(("PYTHON", "RELMODEL"))}
    done = subprocess.run([program, *arguments], cwd=folder, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return done.stdout


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


def test_an_installed_wheel_runs_its_own_code(installed: Path, tmp_path: Path) -> None:
    """Whose kernels have the folder in the user's cache that those of equal text have everywhere."""
    ask = "import relmodel, vision; from relmodel.compiled import cache_key; print(relmodel.__file__, vision.__file__)"
    said = run(installed.with_name("python"), "-c", f"{ask}; print(cache_key())", folder=tmp_path)
    assert str(CHECKOUT) not in said
    assert said.splitlines()[1] == cache_key()


def put_blocks(demo: Path, pair: Pair) -> None:
    """Blocks on a plate in the place of the bulkhead that a wheel shows: whether that is found, other tests tell."""
    for file in (pair.left, pair.right, pair.rig_file, pair.prior_file):
        shutil.copy(file, demo / f"pair_00_{file.name}")
    corners = [[gp_Pnt(*(low + share * size)) for share in (0, 1)] for low, size in block_boxes()]
    shapes = {f"block {k}": BRepPrimAPI_MakeBox(*both).Shape() for k, both in enumerate(corners)}
    write_step((shapes, [(name, name, np.eye(4)) for name in shapes]), demo / "blocks.step")
    (demo / "bulkhead_A.step.gz").write_bytes(gzip.compress((demo / "blocks.step").read_bytes()))
    (demo / "world.yaml").write_text("world: cell\nobjects:\n- {object: bulkhead, variant: A}\n")
    truth = {"world_from_rig": above(0, 0, 520).tolist(), "world_from_object": np.eye(4).tolist()}
    (demo / "pair_00_truth.json").write_text(json.dumps({**truth, "variant": "A", "target_in_object": [0, 0, 0]}))


def test_installed_wheel_runs_the_demonstration(installed: Path, blocks_pair: Pair, tmp_path: Path) -> None:
    """In an empty folder."""
    (demo,) = installed.parent.parent.glob("**/relmodel/data/demo")
    put_blocks(demo, blocks_pair)
    said = run(installed, "demo", folder=tmp_path)
    assert "verdict   pose usable; " in said
    off = re.search(r"pose +([\d.]+) mm and ([\d.]+) degrees", said)
    assert off
    assert float(off[1]) < 1
    assert float(off[2]) < 0.1
    assert (tmp_path / "demo" / "pair_00_overlay.png").stat().st_size > 10_000
    # By the queries and the migrations that it brings, in one process.
    verbs = "from relmodel.app.cli.main import main; print(*(main([verb]) for verb in ('check', 'migrate')))"
    code = f"import os; os.environ['RELMODEL_STORE'] = 'demo/cell.duckdb'; {verbs}"
    assert run(installed.with_name("python"), "-c", code, folder=tmp_path).endswith("0 0\n")
