"""`relmodel replay`: what an inspection decided comes out again from its rows, and what was altered does not."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from scipy.optimize import least_squares

from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import Inspection
from vision.cameras.cameras import perturb, perturbation


def altered(target: str, *statements: str) -> str:
    with Store.open(target) as store, store.write() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement)
    return target


def replayed(store: str, run: int, capsys: pytest.CaptureFixture[str]) -> tuple[int, list[dict[str, Any]], str]:
    capsys.readouterr()
    status = main(["replay", str(run), "--store", store, "--format", "json"])
    said = capsys.readouterr()
    return status, json.loads(said.out), said.err


@pytest.mark.parametrize("engine", ["inspection", "postgresql_inspection"])
def test_all_comes_out_again_without_the_pictures(
    engine: str,
    request: pytest.FixtureRequest,
    copy_store: Callable[[str], str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    inspection: Inspection = request.getfixturevalue(engine)
    store = altered(copy_store(inspection.store), "DELETE FROM image_blob", "DELETE FROM edge_element")
    status, rows, words = replayed(store, inspection.answer["run"], capsys)
    assert (status, words) == (0, "")
    assert all(row["agrees"] for row in rows)
    assert max(row["difference"] or 0.0 for row in rows) < 1e-9
    values = {(row["step"], row["what"]): row["values"] for row in rows}
    assert values["refinement", "residuals"] > 1000
    assert values["localisation 1", "correspondences"] > 500
    assert {step.partition(" ")[0] for step, _ in values} == {"stereo", "localisation", "join", "refinement", "verdict"}


@pytest.mark.parametrize(
    ("statement", "told"),
    [
        ("UPDATE hypothesis SET m03 = m03 + 1e-5 WHERE hypothesis_no = 0", "pose"),
        ("UPDATE edge_measurement SET u = u + 1e-6 WHERE measurement_no = 7 AND view_no = 1", "residuals"),
        ("UPDATE camera_unknown SET value = value + 1e-7 WHERE name = 'centre_u'", "unknowns of the cameras"),
        ("UPDATE hypothesis_support SET evidence = evidence + 1e-3 WHERE camera = 'left'", "evidence"),
        ("UPDATE inspection SET posterior = posterior - 1e-6", "posterior"),
        ("UPDATE inspection SET reason = 'as I said'", "reason"),
        ("UPDATE threshold SET value = 1 WHERE decision = 'verdict' AND name = 'min_posterior'", "verdict"),
        ("UPDATE assignment SET label_no = NULL, reason = 'null_cheaper' WHERE problem_no = 1 AND unit_no = (SELECT"
         " min(unit_no) FROM assignment WHERE problem_no = 1 AND label_no IS NOT NULL)", "labels"),
    ],
)  # fmt: skip
def test_what_was_altered_is_told(
    statement: str,
    told: str,
    inspection: Inspection,
    copy_store: Callable[[str], str],
    capsys: pytest.CaptureFixture[str],
) -> None:
    status, rows, _ = replayed(altered(copy_store(inspection.store), statement), inspection.answer["run"], capsys)
    assert status == 1
    assert told in {row["what"] for row in rows if not row["agrees"]}


def test_another_version_is_named_and_not_failed(
    inspection: Inspection, copy_store: Callable[[str], str], capsys: pytest.CaptureFixture[str]
) -> None:
    store = altered(
        copy_store(inspection.store),
        "UPDATE run SET versions = json_merge_patch(versions, '{\"numpy\": \"1.0\"}'), code_sha256 = 'other'",
    )
    status, _, words = replayed(store, inspection.answer["run"], capsys)
    assert status == 0
    assert f"numpy was 1.0 and is {np.__version__}" in words
    assert "another than the run's" in words


def test_a_dry_replay_counts_rows(inspection: Inspection, capsys: pytest.CaptureFixture[str]) -> None:
    capsys.readouterr()
    run = str(inspection.answer["run"])
    assert main(["replay", run, "--dry", "--store", inspection.store, "--format", "json"]) == 0
    rows = {row["relation"]: row["rows"] for row in json.loads(capsys.readouterr().out)}
    assert rows["problem"] == 3
    assert rows["camera_unknown"] == 20
    for run, words in (("1", "of kind load"), ("99", "there is no run 99")):
        assert main(["replay", run, "--store", inspection.store]) == 2
        assert words in capsys.readouterr().err


def test_the_pose_is_where_the_measurements_are_least_wrong(inspection: Inspection) -> None:
    """By SciPy, with derivatives by differences, from rows alone: weights held, cameras' principal points and responses
    and the shift of each arc's image solved along."""
    run = inspection.answer["run"]
    with Store.open(inspection.store, read_only=True) as store, store.read() as connection:
        rows = store.columns(connection, "replay/measurements", run=run)
        cameras = store.columns(connection, "replay/cameras", run=run)
        poses = store.columns(connection, "replay/poses", run=run)
        unknown = store.rows(connection, "replay/unknowns", run=run)
    world = np.stack([rows[f"world_{axis}"] for axis in "xyz"] + [np.ones(len(rows["u"]))], axis=1)
    names = cameras["camera"].tolist()
    rig_from_camera = _matrices(cameras)
    given = poses["what"].tolist().index("prior")
    prior = _matrices(poses)[given]
    information = np.linalg.cholesky(np.linalg.inv(np.reshape(poses["covariance"][given], (6, 6)))).T
    solved = [row for row in unknown if row.sigma > 0]
    assert {row.name for row in solved} == {"response", "centre_u", "centre_v"}
    start = np.array(inspection.answer["world_from_rig"])
    images = np.stack([rows["view_no"], rows["scene_arc"]], axis=1)
    _, first_of, image = np.unique(images, axis=0, return_index=True, return_inverse=True)
    shift_sigma, image, known = rows["arc_shift"][first_of], image.ravel(), 6 + len(solved)
    np.testing.assert_array_equal(shift_sigma[image], rows["arc_shift"])

    def wrong(x: np.ndarray[Any, Any]) -> np.ndarray[Any, Any]:
        pose = perturb(start, x[:6])
        own = {(row.camera, row.name): value for row, value in zip(solved, x[6:known], strict=True)}
        shift, out = x[known:] * shift_sigma, []
        for number, name in enumerate(names):
            of = rows["view_no"] == cameras["view_no"][number]
            at = world[of] @ np.linalg.inv(pose @ rig_from_camera[number]).T
            u = cameras["fx"][number] * at[:, 0] / at[:, 2] + cameras["cx"][number] + own[name, "centre_u"]
            v = cameras["fy"][number] * at[:, 1] / at[:, 2] + cameras["cy"][number] + own[name, "centre_v"]
            across = rows["normal_u"][of] * (rows["u"][of] - u) + rows["normal_v"][of] * (rows["v"][of] - v)
            across -= rows["response"][of] * own[name, "response"] + shift[image[of]]
            out.append(across * np.sqrt(rows["weight"][of]) / rows["sigma"][of])
        out.append(information @ perturbation(prior, pose))
        out.append(np.array([(x - row.expected) / row.sigma for row, x in zip(solved, x[6:known], strict=True)]))
        out.append(x[known:])
        return np.concatenate(out)

    first = np.concatenate([np.zeros(6), [row.value for row in solved], np.zeros(len(shift_sigma))])
    scale = np.repeat([0.01, 1e-5, 0.01, 0.1], [3, 3, len(solved), len(shift_sigma)])
    found = least_squares(wrong, first, x_scale=scale, xtol=1e-14)
    sigma = np.sqrt(np.diag(np.array(inspection.answer["covariance"])))
    assert (np.abs(found.x[:6]) < 0.01 * sigma).all()


def _matrices(columns: Any) -> np.ndarray[Any, Any]:
    out = np.zeros((len(columns["m00"]), 4, 4))
    for i in range(3):
        for j in range(4):
            out[:, i, j] = columns[f"m{i}{j}"]
    out[:, 3, 3] = 1
    return out


def test_a_run_that_kept_decisions_alone_replays_its_verdict(
    minimal: Inspection, capsys: pytest.CaptureFixture[str]
) -> None:
    status, rows, _ = replayed(minimal.store, minimal.answer["run"], capsys)
    assert status == 0
    assert {row["step"] for row in rows} == {"verdict"}
