"""Cameras of a rig under any names, one to sixteen of them, and those that say nothing; wrong names."""

from __future__ import annotations

import shutil
from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast

import cv2
import numpy as np
import pytest
import yaml

import relmodel
from relmodel.app.cli.main import main
from relmodel.store import Store
from tests.app.cli.conftest import Inspection, Pair, asked
from tests.given import Capsys
from tests.vision.localisation.scenes import above
from vision.cameras.files import read_rig
from vision.cameras.images import read_picture
from vision.inspection.pictures import measure_quality


def test_names_and_their_order_change_no_digit(blocks_seen: Inspection, minimal: Inspection) -> None:
    """Not even where the one that comes first in the rig is given last, between options, and comes last by its name;
    nor do matched arcs, which the first has."""
    answer = minimal.answer
    same = ("world_from_rig", "covariance", "posterior", "sigma", "hypotheses", "parts_in_view", "equivalent")
    assert {key: answer[key] for key in same} == {key: blocks_seen.answer[key] for key in same}
    states, matched = ([it["state"] for it in one["presence"]["items"]] for one in (answer, blocks_seen.answer))
    assert states == matched
    assert list(answer["world_from_camera"]) == ["prior", "below"]
    assert list(answer["world_from_camera"].values()) == list(blocks_seen.answer["world_from_camera"].values())
    newest = "run_id = (SELECT max(id) FROM run)"
    with relmodel.open(minimal.store) as opened:
        given = opened.query(f"SELECT role, name FROM run_input WHERE {newest} ORDER BY role")  # noqa: S608
        cameras = opened.query(f"SELECT camera FROM inspection_image WHERE {newest} ORDER BY camera_no")  # noqa: S608
    assert list(given) == [
        ("below", "right.png"), ("camera prior", "left.png"), ("prior", "prior.yaml"), ("rig", "named.yaml"),
    ]  # fmt: skip
    assert list(cameras) == [("prior",), ("below",)]


def test_two_cameras_are_located_and_judged_together_without_a_blind_one(
    blocks_template: Path, blocks_pair: Pair, tmp_path: Path
) -> None:
    """Of arrays of each kind, which the store keeps."""
    pair = blocks_pair
    store, rig = str(shutil.copy(blocks_template, tmp_path / "cell.duckdb")), tmp_path / "three.yaml"
    greys = {name: np.asarray(cv2.imread(str(getattr(pair, name)), cv2.IMREAD_GRAYSCALE)) for name in ("left", "right")}
    capped = np.clip(np.random.default_rng(1).normal(8, 1, (240, 320)), 0, 255).astype(np.uint8)
    pictures: dict[str, Any] = {
        "z2": np.rint(greys["right"] / 255 * (2**16 - 1)).astype(np.uint16),
        "a b": greys["left"].astype(np.float32) / 255,
        "capped": np.dstack([capped] * 3),
    }
    names = {"a b": "left", "z2": "right", "capped": "left"}
    cameras = {name: pair.rig["cameras"][of] for name, of in names.items()}
    rig.write_text(yaml.safe_dump({"cameras": cameras}, sort_keys=False))
    with relmodel.open(store, read_only=False) as opened:
        answer = opened.inspect(rig=rig, pictures=pictures, prior=pair.prior_file, ignore_blind_camera=True)
        kept = opened.query(
            "SELECT camera, bytes FROM inspection_image AS v JOIN image_blob AS b ON b.image_id = v.image_id"
        )
    assert answer.verdict == "accepted", answer.reason
    assert np.abs(np.array(answer.world_from_rig) - above(0, 0, 520))[:3, 3].max() < 1
    assert answer.notes[0].startswith("camera capped is ignored: camera capped shows next to nothing")
    assert list(answer.world_from_camera) == ["a b", "z2"]
    for name, data in kept:
        decoded = np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), cv2.IMREAD_UNCHANGED))
        white = 2**16 - 1 if decoded.dtype == np.uint16 else 1
        given = pictures[name] * white if pictures[name].dtype.kind == "f" else pictures[name]
        np.testing.assert_allclose(decoded, given, atol=0.5 if white > 1 else 0)
    assert main(["check", "--store", store]) == 0


@pytest.mark.parametrize(
    ("verb", "pictures", "status", "said"),
    [
        ("inspect", ["left={left}", "top={right}"], 3, "the rig has no camera 'top' (it has left, right)"),
        ("inspect", ["left={left}", "left={right}"], 2, "two pictures are given of the camera 'left'"),
        ("inspect", ["{left}", "{right}"], 2, "two pictures are given without the name of a camera"),
        ("inspect", ["{left}"], 2, "a picture is given without the name of its camera, and the rig has left, right"),
        ("inspect", [], 2, "a picture must be given"),
        ("inspect", ["left="], 2, "'left=' names no picture"),
        ("inspect", ["left={left}", "right=none.png"], 3, "there is no image none.png"),
        ("inspect", [f"c{n}={{left}}" for n in range(17)], 2, "17 pictures are given: give 1 to 16"),
        ("inspect", [f"c{n}={{left}}" for n in range(16)], 3, "the rig has no camera 'c0'"),
        ("stereo", ["left={left}"], 2, "stereo is of two pictures"),
        ("stereo", ["left={left}", "top={right}"], 3, "the rig has no camera 'top' (it has left, right)"),
        ("stereo", ["left={left}", "right={right}", "--method", "census"], 2, "use one of pong, relational"),
    ],
)
def test_a_wrong_name_is_one_sentence(
    verb: str,
    pictures: list[str],
    status: int,
    said: str,
    blocks_template: Path,
    blocks_pair: Pair,
    tmp_path: Path,
    capsys: Capsys,
) -> None:
    store = str(shutil.copy(blocks_template, tmp_path / "cell.duckdb"))
    words = [word.format(left=blocks_pair.left, right=blocks_pair.right) for word in pictures]
    assert main([verb, *words, "--rig", str(blocks_pair.rig_file), "--store", store]) == status
    (line,) = [line for line in capsys.readouterr().err.splitlines() if line.startswith(f"relmodel {verb}:")]
    assert said in line


def test_a_picture_of_an_earlier_run_is_stale_beside_a_new_one(inspection: Inspection, pair: Pair) -> None:
    """The same pictures of both cameras once more are no matter."""
    answer, rig = inspection.answer, read_rig(pair.rig_file)
    question = "SELECT stale_run_id, blur_px < 1.5 AND edges > 10 AND saturated < 0.1 FROM inspection_image"
    left, right = (read_picture(file) for file in (pair.left, pair.right))

    def stale(store: Store, other: str) -> list[int | None]:
        elements: Any = SimpleNamespace(elements=SimpleNamespace(x=np.zeros(9)))
        pictures = {"left": left.sha256, "right": other}
        seen = {
            name: SimpleNamespace(picture=SimpleNamespace(sha256=sha256, grey=left.grey), primitives=elements)
            for name, sha256 in pictures.items()
        }
        found = measure_quality(answer["run"] + 1, store, rig, cast(Any, seen))
        return [it.stale_run for it in found.values()]

    with Store.open(inspection.store, read_only=True) as store:
        assert asked(store, question) == [(None, True), (None, True)]
        assert stale(store, right.sha256) == [None, None]
        assert stale(store, "another") == [answer["run"], None]
    assert (answer["missing"], answer["notes"]) == ([], [])
