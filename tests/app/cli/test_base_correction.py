"""An inspection of a mounted rig: the correction of its carrier, in the answer, in words and as rows."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import pytest
import sqlalchemy as sa
import yaml
from PIL import Image
from scipy.optimize import least_squares
from scipy.spatial.transform import Rotation

from relmodel.app.cli.main import main
from relmodel.geometry.transforms import MATRIX_COLUMNS, matrices
from relmodel.store import Store
from relmodel.world.kinematics import mount_of_rig
from tests.app.cli.conftest import DEMO, Inspection, Pair, inspected
from tests.app.cli.slider import BASE, TRAVEL, carriage, carriage_from_rig, write_world
from vision.cameras.files import read_rig
from vision.cameras.record import find_rig
from vision.inspection.demonstration import read_truth

Array = npt.NDArray[np.float64]

TRUTH = read_truth(DEMO / "pair_00_truth.json")


def pose(delta: Array) -> Array:
    """The transform (4, 4) of a perturbation (6,)."""
    out = np.eye(4)
    out[:3, :3], out[:3, 3] = Rotation.from_rotvec(delta[3:]).as_matrix(), delta[:3]
    return out


def delta(a: Array, b: Array) -> Array:
    """The perturbation (6,) that takes pose a to pose b."""
    d = np.linalg.inv(a) @ b
    return np.concatenate([d[:3, 3], Rotation.from_matrix(d[:3, :3]).as_rotvec()])


def rows(store: str, table: str, run: int) -> list[dict[str, Any]]:
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        of = sa.table(table, sa.column("run_id"))
        asked = sa.select(sa.text("*")).select_from(of).where(of.c.run_id == run)
        return [dict(r._mapping) for r in connection.execute(asked)]


@pytest.fixture(scope="module")
def store(inspection: Inspection, copy_store: Callable[[str], str]) -> str:
    """A copy, in which some inspect again."""
    return copy_store(inspection.store)


@pytest.fixture(scope="module")
def answer(inspection: Inspection) -> dict[str, Any]:
    return inspection.answer


@pytest.fixture(scope="module")
def mount(pair: Pair) -> Array:
    return carriage_from_rig(pair.prior["world_from_rig"])


def test_the_base_is_corrected_by_closed_form(answer: dict[str, Any], pair: Pair, mount: Array) -> None:
    """The pose that the world gives the rig is the prior, so base = found prior^-1 base, with the joint held."""
    assert answer["verdict"] == "accepted"
    it, found = answer["base_correction"], np.array(answer["world_from_rig"])
    expected = found @ np.linalg.inv(np.array(pair.prior["world_from_rig"])) @ BASE
    assert np.abs(it["world_from_object"] - expected).max() < 1e-7
    assert it["shift_mm"] == pytest.approx(expected[:3, 3] - BASE[:3, 3])
    assert it["turn_rad"] == pytest.approx(delta(BASE, expected)[3:])
    assert it["carrier"] == "slider"
    assert it["joints"] == {"travel": TRAVEL}

    # Its covariance, against differences of bases computed from perturbed poses.
    base_from_rig = carriage(TRAVEL) @ mount

    def base(step: Array) -> Array:
        return np.asarray(found @ pose(step) @ np.linalg.inv(base_from_rig))

    h = 1e-4
    slope = np.stack([delta(expected, base(h * e)) - delta(expected, base(-h * e)) for e in np.eye(6)], 1) / (2 * h)
    propagated = slope @ np.array(answer["covariance"]) @ slope.T
    sigma = np.sqrt(np.diag(propagated))
    assert np.abs((it["covariance"] - propagated) / np.outer(sigma, sigma)).max() < 1e-4

    # And the truth: of 6 degrees of freedom, one in a million is beyond 38.
    off = delta(np.array(it["world_from_object"]), TRUTH.world_from_rig @ np.linalg.inv(base_from_rig))
    assert off @ np.linalg.solve(it["covariance"], off) < 38


def test_rows_and_json_say_the_same(answer: dict[str, Any], store: str) -> None:
    said = answer["base_correction"]
    (row,) = rows(store, "base_correction", answer["run"])
    stored = np.array([row[c] for c in MATRIX_COLUMNS]).reshape(3, 4)
    assert np.array_equal(stored, np.array(said["world_from_object"])[:3])
    assert [row[f"shift_{c}"] for c in "xyz"] == said["shift_mm"]
    assert [row[f"turn_{c}"] for c in "xyz"] == said["turn_rad"]
    assert list(row["covariance"]) == np.ravel(said["covariance"]).tolist()
    assert row["robot"] == ""
    held = {
        "joint": "travel",
        "stated_value": TRAVEL,
        "value": TRAVEL,
        "prior_sigma": None,
        "sigma": None,
        "unit": "mm",
    }
    assert rows(store, "joint_correction", answer["run"]) == [{"run_id": answer["run"], **held}]
    assert main(["check", "--store", store]) == 0


def test_a_joint_with_a_sigma_shares_the_correction(
    store: str, pair: Pair, mount: Array, capsys: pytest.CaptureFixture[str]
) -> None:
    """One camera of the mounted rig, the joint said to stand elsewhere; against a general least squares."""
    stated, sigma, base_sigma = TRAVEL + 6, 4.0, np.repeat([2.0, np.radians(0.3)], 3)
    asked = ["--set", f"travel={stated}", "--joint-sigma", f"travel={sigma}"]
    asked += ["--base-sigma-mm", "2", "--base-sigma-deg", "0.3"]
    capsys.readouterr()
    assert main(["inspect", *pair.options(right=None), *asked, "--store", store]) == 0
    said = capsys.readouterr().err.splitlines()
    run = int(next(line for line in said if line.startswith("run ")).split()[1].rstrip(":"))
    (seen,), (it,), (joint,) = (rows(store, name, run) for name in ("pose", "base_correction", "joint_correction"))
    found, corrected = ({c: row[c] for c in MATRIX_COLUMNS} for row in (seen, it))
    weight = np.linalg.cholesky(np.linalg.inv(np.reshape(seen["covariance"], (6, 6)))).T

    def residuals(x: Array) -> Array:
        rig = BASE @ pose(x[:6]) @ carriage(stated + x[6]) @ mount
        return np.concatenate([weight @ delta(matrices(found), rig), x[:6] / base_sigma, x[6:] / sigma])

    scale = [1, 1, 1, 1e-3, 1e-3, 1e-3, 1]
    best = least_squares(residuals, np.zeros(7), x_scale=scale, xtol=1e-13, ftol=1e-13)
    off = delta(BASE @ pose(best.x[:6]), matrices(corrected))
    assert np.abs(off[:3]).max() < 1e-3
    assert np.abs(off[3:]).max() < 1e-6
    jacobian = np.asarray(best.jac, float)
    spread = np.linalg.inv(jacobian.T @ jacobian)
    assert np.sqrt(np.diag(np.reshape(it["covariance"], (6, 6)))) == pytest.approx(
        np.sqrt(np.diag(spread)[:6]), rel=0.01
    )
    assert (joint["joint"], joint["stated_value"], joint["prior_sigma"]) == ("travel", stated, sigma)
    assert joint["value"] == pytest.approx(stated + best.x[6], abs=1e-3)
    assert joint["sigma"] == pytest.approx(np.sqrt(spread[6, 6]), rel=0.01)

    # The same in words; the worst direction by the spectral norm.
    base, travel = (next(line for line in said if line.startswith(word)) for word in ("the base of", "joint "))
    shift, turn = ([it[f"{name}_{c}"] for c in "xyz"] for name in ("shift", "turn"))
    worst = 2 * np.sqrt([np.linalg.norm(np.reshape(it["covariance"], (6, 6))[i : i + 3, i : i + 3], 2) for i in (0, 3)])
    assert base.startswith(f"the base of slider stands {np.linalg.norm(shift):.2f} mm (")
    assert f"and {np.degrees(np.linalg.norm(turn)):.3f} degrees from where the world has it" in base
    assert base.endswith(f"known to {worst[0]:.2g} mm and {np.degrees(worst[1]):.2g} degrees (two sigma)")
    assert travel.startswith(f"joint travel at {joint['value']:.6g} mm, not {stated:g}: ")
    assert travel.endswith(f"known to {2 * joint['sigma']:.2g} mm (two sigma)")


def test_a_pose_that_is_not_accepted_corrects_nothing(store: str, pair: Pair, tmp_path: Path) -> None:
    with Image.open(pair.left) as picture:
        Image.new("L", picture.size, 128).save(tmp_path / "grey.png")
    said = inspected(store, *pair.options(left=tmp_path / "grey.png", right=None))
    assert said["verdict"] == "refused"
    assert said["base_correction"] is None
    assert not rows(store, "base_correction", said["run"])
    assert not rows(store, "joint_correction", said["run"])


def test_what_cannot_be_corrected_is_said_before_anything_is_written(
    store: str, pair: Pair, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    target = str(tmp_path / "cell.duckdb")
    shutil.copy(store, target)

    def inspections() -> int:
        with Store.open(target, read_only=True) as opened, opened.read() as connection:
            return len(connection.execute(opened.table("inspection").select()).all())

    def refused(status: int, sentence: str, *words: str) -> None:
        before = inspections()
        assert main(["inspect", *pair.options(), *words, "--store", target]) == status
        assert sentence in capsys.readouterr().err
        assert inspections() == before

    refused(2, "no object arm carries this rig: name the one that does with --on: slider", "--on", "arm")
    refused(3, "joint 'lift' is unknown: name one of those that move by themselves: travel", "--joint-sigma", "lift=1")
    refused(3, "that of joint 'travel' is 0: give one above zero", "--joint-sigma", "travel=0")
    refused(2, "--base-sigma-mm and --base-sigma-deg must be above zero", "--base-sigma-mm", "0")
    _, two = write_world(tmp_path, pair.rig_file, pair.prior["world_from_rig"], "one", "two")
    assert main(["world", str(two), "--store", target]) == 0
    refused(2, "several objects carry this rig: say with --on which of them took the pictures: one, two")
    assert main(["world", str(DEMO / "world.yaml"), "--store", target]) == 0
    refused(2, "the world does not mount this rig", "--set", "travel=1")


def test_a_rig_of_other_content_is_not_mounted(store: str, pair: Pair) -> None:
    rig = read_rig(pair.rig_file)
    left = rig.cameras["left"]
    others = rig.only("left"), replace(rig, cameras={**rig.cameras, "left": replace(left, matrix=left.matrix + 1e-9)})
    with Store.open(store, read_only=True) as opened, opened.read() as connection:
        found = find_rig(opened, connection, rig)
        assert found is not None
        mounted = mount_of_rig(opened, connection, 1, found, None)
        assert mounted is not None
        assert mounted.world_from_rig == pytest.approx(np.array(pair.prior["world_from_rig"]))
        assert mount_of_rig(opened, connection, 1, found + 100, None) is None
        known = [row.rig_id for row in opened.rows(connection, "world/mounts", world_id=1)]
        assert known == [found]
        assert not {find_rig(opened, connection, other) for other in others} & {found}


def test_where_says_of_an_answer_what_the_inspection_said(
    answer: dict[str, Any], store: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "answer.json").write_text(json.dumps(answer))
    capsys.readouterr()
    assert main(["where", "head", "--found", str(tmp_path / "answer.json"), "--store", store]) == 0
    there = yaml.safe_load(capsys.readouterr().out)
    assert there.keys() == answer["base_correction"].keys()
    for name, value in answer["base_correction"].items():
        if isinstance(value, list):
            np.testing.assert_allclose(there[name], value, rtol=1e-6, atol=1e-9)
        else:
            assert there[name] == value
