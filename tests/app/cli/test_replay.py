"""`relmodel replay`: an inspection made again from its pictures comes out as stored, and what was altered does not."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import sqlalchemy as sa
import yaml
from scipy.optimize import least_squares

from relmodel.app.cli.main import main
from relmodel.store import Store
from relmodel.store.bulk import fetch_columns
from tests.app.cli.conftest import DEMO, Inspection, Pair
from tests.app.cli.slider import write_world
from tests.reading import load
from vision.cameras.cameras import perturb, perturbation

RIG = sa.text("SELECT rig_id FROM inspection WHERE run_id = :run")
PRIOR = sa.text("SELECT * FROM inspection WHERE run_id = :run")
UNKNOWNS = sa.text("SELECT camera, name, value, expected, sigma FROM camera_unknown WHERE run_id = :run")
MEASUREMENTS = sa.text("SELECT * FROM edge_measurement WHERE run_id = :run ORDER BY view_no, measurement_no")


def altered(target: str, *statements: str) -> str:
    with Store.open(target) as store, store.write() as connection:
        for statement in statements:
            connection.exec_driver_sql(statement)
    return target


def replayed(store: str, run: int, capsys: pytest.CaptureFixture[str]) -> tuple[int, dict[str, Any], str]:
    """Exit status, the rows printed by relation, and what was said."""
    capsys.readouterr()
    status = main(["replay", str(run), "--store", store, "--format", "json"])
    said = capsys.readouterr()
    words = "".join(line for line in said.err.splitlines(True) if not line.startswith("working, "))
    return status, {row["relation"]: row for row in json.loads(said.out)}, words


def test_all_comes_out_again(postgresql_inspection: Inspection, capsys: pytest.CaptureFixture[str]) -> None:
    """On PostgreSQL; what DuckDB gives again, all tests below compare."""
    inspection = postgresql_inspection
    run = inspection.answer["run"]
    status, rows, words = replayed(inspection.store, run, capsys)
    assert [row for row in rows.values() if row["differing"]] == []
    assert (status, words) == (0, "")
    assert max(row["difference"] or 0.0 for row in rows.values()) < 1e-9
    assert all(row["rows"] == row["again"] > 0 for row in rows.values())
    with Store.open(inspection.store, read_only=True) as store, store.read() as connection:
        ledger = sa.text("SELECT DISTINCT relation FROM ledger WHERE run_id = :run")
        written = {name for name in connection.scalars(ledger, {"run": run}) if "run_id" in store.table(name).c}
        assert connection.scalar(sa.text("SELECT max(id) FROM run")) == run
    assert written - {"run_event", "row_digest"} <= set(rows)
    assert {"edge_element", "unit_relation"} <= set(rows)


def test_what_was_altered_is_told(
    inspection: Inspection, copy_store: Callable[[str], str], capsys: pytest.CaptureFixture[str]
) -> None:
    """A number, a text, a row that is gone, and what was extracted."""
    store = altered(
        copy_store(inspection.store),
        "UPDATE edge_measurement SET u = u + 1e-6 WHERE measurement_no = 7 AND view_no = 1",
        "UPDATE inspection SET reason = 'as I said'",
        "DELETE FROM assignment WHERE problem_no = 1 AND unit_no = 3",
        "UPDATE image_arc SET length = length + 1 WHERE image_arc_no = 5",
    )
    status, rows, _ = replayed(store, inspection.answer["run"], capsys)
    assert status == 1
    told = {name: (row["column"], row["differing"]) for name, row in rows.items() if row["differing"]}
    assert told == {
        "edge_measurement": ("u", 1), "inspection": ("reason", 1), "assignment": (None, 1), "image_arc": ("length", 2),
    }  # fmt: skip


def test_without_pictures_nothing_is_made_again(
    inspection: Inspection, copy_store: Callable[[str], str], capsys: pytest.CaptureFixture[str]
) -> None:
    """Which is said, as it is of runs that inspected nothing; labellings are proved from their rows all the same."""
    store, run = altered(copy_store(inspection.store), "DELETE FROM image_blob"), str(inspection.answer["run"])
    refused = {run: f"so that run {run} cannot be made again", "1": "of kind load", "99": "there is no run 99"}
    for number, words in refused.items():
        assert main(["replay", number, "--store", store]) == 2
        assert words in capsys.readouterr().err
    altered(store, "DELETE FROM row_digest", "UPDATE problem SET cost = cost - 1 WHERE problem_no = 1")
    assert main(["check", "--store", store]) == 1
    assert "matching_cost" in capsys.readouterr().out


def test_a_run_that_kept_decisions_alone_is_made_again(
    minimal: Inspection,
    pair: Pair,
    copy_store: Callable[[str], str],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
) -> None:
    """And what has changed since is named and not failed: another version of a package, other code, another revision
    of the world, and a variant that was loaded later."""
    store = altered(
        copy_store(minimal.store),
        "UPDATE run SET versions = json_merge_patch(versions, '{\"numpy\": \"1.0\"}'), code_sha256 = 'other'",
    )
    _, file = write_world(tmp_path, pair.rig_file, pair.prior["world_from_rig"], "slider")
    world = yaml.safe_load(file.read_text())
    world["objects"][0]["world_from_object"][0][3] += 100.0
    file.write_text(yaml.safe_dump(world))
    assert main(["world", str(file), "--store", store]) == 0
    with Store.open(store) as opened:
        load(opened, DEMO / "bulkhead_B.step.gz", name="bulkhead", variant="B")
    status, rows, words = replayed(store, minimal.answer["run"], capsys)
    assert (status, [name for name, row in rows.items() if row["differing"]]) == (0, [])
    assert "edge_measurement" not in rows
    assert rows["hypothesis"]["rows"] > 0
    assert f"numpy was 1.0 and is {np.__version__}" in words
    assert "the code of relmodel is another than the run's" in words
    assert "has changed since" in words


def test_the_pose_is_where_the_measurements_are_least_wrong(inspection: Inspection) -> None:
    """By SciPy, with derivatives by differences, from rows alone: weights held, cameras' principal points and responses
    and the shift of each arc's image solved along."""
    run = inspection.answer["run"]
    with Store.open(inspection.store, read_only=True) as store, store.read() as connection:
        rows = fetch_columns(connection, MEASUREMENTS, {"run": run})
        cameras = store.columns(connection, "cameras/rig", rig_id=connection.scalar(RIG, {"run": run}))
        prior = fetch_columns(connection, PRIOR, {"run": run})
        unknown = connection.execute(UNKNOWNS, {"run": run}).all()
    world = np.stack([rows[f"world_{axis}"] for axis in "xyz"] + [np.ones(len(rows["u"]))], axis=1)
    names = cameras["camera"].tolist()
    rig_from_camera = _matrices(cameras)
    given = _matrices(prior)[0]
    information = np.linalg.cholesky(np.linalg.inv(np.reshape(prior["prior_covariance"][0], (6, 6)))).T
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
            of = rows["view_no"] == number  # views are in the order of the cameras
            at = world[of] @ np.linalg.inv(pose @ rig_from_camera[number]).T
            u = cameras["fx"][number] * at[:, 0] / at[:, 2] + cameras["cx"][number] + own[name, "centre_u"]
            v = cameras["fy"][number] * at[:, 1] / at[:, 2] + cameras["cy"][number] + own[name, "centre_v"]
            across = rows["normal_u"][of] * (rows["u"][of] - u) + rows["normal_v"][of] * (rows["v"][of] - v)
            across -= rows["response"][of] * own[name, "response"] + shift[image[of]]
            out.append(across * np.sqrt(rows["weight"][of]) / rows["sigma"][of])
        out.append(information @ perturbation(given, pose))
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
