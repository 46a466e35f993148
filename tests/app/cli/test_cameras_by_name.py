"""Cameras of a rig under any names, one to sixteen of them, and what is said of names that are wrong."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import yaml

import relmodel
from relmodel.app.cli.main import main
from relmodel.errors import InputError, UsageError
from tests.app.cli.conftest import DEMO, Inspection, Pair, inspected
from vision.cameras.images import pictures_as_files
from vision.inspection.demonstration import measure_pose_error, read_truth


@pytest.fixture(scope="module")
def store(bulkhead_template: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    return str(shutil.copy(bulkhead_template, tmp_path_factory.mktemp("named") / "cell.duckdb"))


def named_rig(pair: Pair, folder: Path, names: dict[str, str]) -> str:
    """The rig of the pair with the cameras of these names, each the one of the pair that it is the name of."""
    file = folder / "named.yaml"
    cameras = {name: pair.rig["cameras"][of] for name, of in names.items()}
    file.write_text(yaml.safe_dump({"cameras": cameras}, sort_keys=False))
    return str(file)


def test_names_and_their_order_change_no_digit(store: str, inspection: Inspection, pair: Pair, tmp_path: Path) -> None:
    """Not even where the one that comes first in the rig is given last, between options, and comes last by its name."""
    rig = named_rig(pair, tmp_path, {"prior": "left", "below": "right"})
    answer = inspected(
        store, f"below={pair.right}", "--rig", rig, "--prior", str(pair.prior_file), f"prior={pair.left}"
    )
    same = ("world_from_rig", "covariance", "posterior", "sigma", "hypotheses", "parts_in_view", "equivalent")
    assert {key: answer[key] for key in same} == {key: inspection.answer[key] for key in same}
    assert list(answer["world_from_camera"]) == ["prior", "below"]
    assert list(answer["world_from_camera"].values()) == list(inspection.answer["world_from_camera"].values())
    with relmodel.open(store) as opened:
        given = opened.query("SELECT role, name FROM run_input WHERE run_id = (SELECT max(id) FROM run) ORDER BY role")
        cameras = opened.query(
            "SELECT camera FROM inspection_image WHERE run_id = (SELECT max(id) FROM run) ORDER BY camera_no"
        )
    assert list(given) == [
        ("below", "right.png"), ("camera prior", "left.png"), ("prior", pair.prior_file.name), ("rig", "named.yaml"),
    ]  # fmt: skip
    assert list(cameras) == [("prior",), ("below",)]


def test_four_cameras_are_located_and_judged_together(store: str, pair: Pair, tmp_path: Path) -> None:
    """Two at the place of each of the pair, with noise of their own, as arrays of each kind, which the store keeps."""
    greys = {name: np.asarray(cv2.imread(str(getattr(pair, name)), cv2.IMREAD_GRAYSCALE)) for name in ("left", "right")}
    noise = np.random.default_rng(1)
    again = {name: np.clip(grey + noise.normal(0, 1, grey.shape), 0, 255) for name, grey in greys.items()}
    pictures: dict[str, Any] = {
        "z2": np.rint(again["right"] / 255 * (2**16 - 1)).astype(np.uint16),
        "Z": greys["left"],
        "a b": again["left"].astype(np.float32) / 255,
        "1": np.dstack([greys["right"]] * 3),
    }
    rig = named_rig(pair, tmp_path, {"Z": "left", "a b": "left", "1": "right", "z2": "right"})
    with relmodel.open(store, read_only=False) as opened:
        answer = opened.inspect(rig=rig, pictures=pictures, prior=pair.prior_file)
        kept = opened.query(
            "SELECT camera, bytes FROM inspection_image AS v JOIN image_blob AS b ON b.image_id = v.image_id "
            "WHERE run_id = (SELECT max(id) FROM run) ORDER BY camera_no"
        )
        matched = opened.query("SELECT count(*) FROM triangulated_unit WHERE run_id = (SELECT max(id) FROM run)")
    assert answer.verdict == "accepted", answer.reason
    assert measure_pose_error(np.asarray(answer.world_from_rig), read_truth(DEMO / "pair_00_truth.json")).target_mm < 1
    assert list(answer.world_from_camera) == ["Z", "a b", "1", "z2"]
    assert next(iter(matched))[0] > 30
    for name, data in kept:
        decoded = np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED))
        white = 2**16 - 1 if decoded.dtype == np.uint16 else 1
        given = pictures[name] * white if pictures[name].dtype.kind == "f" else pictures[name]
        np.testing.assert_allclose(decoded, given, atol=0.5 if white > 1 else 0)
    assert main(["check", "--store", store]) == 0


@pytest.mark.parametrize(
    ("pictures", "status", "said"),
    [
        (["left={left}", "top={right}"], 3, "the rig has no camera 'top' (it has left, right)"),
        (["left={left}", "left={right}"], 2, "two pictures are given of the camera 'left'"),
        (["{left}", "{right}"], 2, "two pictures are given without the name of a camera"),
        (["{left}"], 2, "a picture is given without the name of its camera, and the rig has left, right"),
        ([], 2, "a picture must be given"),
        (["left="], 2, "'left=' names no picture"),
        (["left={left}", "right=none.png"], 3, "there is no image none.png"),
        ([f"c{n}={{left}}" for n in range(17)], 2, "17 pictures are given: give 1 to 16"),
        ([f"c{n}={{left}}" for n in range(16)], 3, "the rig has no camera 'c0'"),
    ],
)
def test_a_wrong_name_is_one_sentence(
    pictures: list[str], status: int, said: str, store: str, pair: Pair, capsys: pytest.CaptureFixture[str]
) -> None:
    words = [word.format(left=pair.left, right=pair.right) for word in pictures]
    assert main(["inspect", *words, "--rig", str(pair.rig_file), "--store", store]) == status
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith("relmodel inspect:")]
    assert said in line


def test_the_only_camera_of_a_rig_needs_no_name(store: str, left_alone: Inspection, pair: Pair, tmp_path: Path) -> None:
    """And a calibration of OpenCV that does not say the size of its pictures has that of the one given."""
    camera = pair.rig["cameras"]["left"]
    file = cv2.FileStorage(str(tmp_path / "one.yml"), cv2.FILE_STORAGE_WRITE)
    file.write("camera_matrix", np.array(camera["matrix"]))
    file.write("distortion_coefficients", np.zeros((1, 5)))
    file.release()
    answer = inspected(store, str(pair.left), "--rig", str(tmp_path / "one.yml"), "--prior", str(pair.prior_file))
    assert answer["world_from_rig"] == left_alone.answer["world_from_rig"]


def test_arrays_that_are_no_pictures() -> None:
    for array, said in (
        (np.zeros(3), "has the shape"),
        (np.zeros((4, 4, 2), np.uint8), "has the shape"),
        (np.zeros((4, 4), np.int32), "is of int32"),
        (np.full((4, 4), 200.0), "not all from 0 to 1"),
        (np.full((4, 4), np.nan), "not all from 0 to 1"),
    ):
        with pytest.raises(InputError, match=f"the array of camera 'top' .*{said}"):
            pictures_as_files({"top": array})
    with pytest.raises(UsageError, match="no pictures are given"):
        pictures_as_files({})
