"""Cameras of a rig under any names, one that says nothing, and wrong names."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any, cast
from unittest.mock import Mock

import cv2
import numpy as np
import pytest
import yaml

import relmodel
from relmodel.app.cli.main import main
from relmodel.errors import InputError
from relmodel.store import Store
from tests.app.cli.conftest import Inspection, Pair, asked, copied
from tests.given import Capsys
from vision.cameras.files import read_rig
from vision.cameras.images import read_picture
from vision.inspection.pictures import measure_quality


def test_names_and_their_order_change_no_digit(blocks_seen: Inspection, minimal: Inspection) -> None:
    """Not even where the one that comes first in the rig is given last, between options, and comes last by its name;
    nor do matched arcs, which the first has, nor a camera that sees nothing."""
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
        ("below", "right.png"), ("camera prior", "left.png"), ("capped", "capped.png"), ("prior", "prior.yaml"),
        ("rig", "named.yaml"),
    ]  # fmt: skip
    assert list(cameras) == [("capped",), ("prior",), ("below",)]
    assert answer["notes"][0].startswith("camera capped is ignored: camera capped shows next to nothing")


def test_pictures_are_arrays_too_and_are_kept_as_such(
    blocks_template: Path, blocks_pair: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Of two kinds; an inspection that fails once it has read them keeps them."""
    store, rig = copied(blocks_template)(tmp_path), tmp_path / "two.yaml"
    left = np.asarray(cv2.imread(str(blocks_pair.left), cv2.IMREAD_GRAYSCALE))
    pictures: dict[str, Any] = {"a b": left.astype(np.float32) / 255, "colours": np.dstack([left, left // 2, left])}
    rig.write_text(yaml.safe_dump({"cameras": dict(zip(pictures, blocks_pair.rig["cameras"].values(), strict=True))}))
    monkeypatch.setattr("vision.inspection.inspection.Locator", Mock(side_effect=InputError("so far")))
    with relmodel.open(store, read_only=False) as opened:
        with pytest.raises(InputError, match="so far"):
            opened.inspect(rig=rig, pictures=pictures, prior=blocks_pair.prior_file)
        kept = opened.query("SELECT bytes FROM image_blob ORDER BY image_id")
    pictures["a b"] = np.rint(pictures["a b"] * (2**16 - 1)).astype(np.uint16)
    for (data,), given in zip(kept, pictures.values(), strict=True):
        np.testing.assert_array_equal(np.asarray(cv2.imdecode(np.frombuffer(data, np.uint8), -1)), given)


@pytest.fixture(scope="module")
def store(blocks_template: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    return copied(blocks_template)(tmp_path_factory.mktemp("names"))


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
    verb: str, pictures: list[str], status: int, said: str, store: str, blocks_pair: Pair, capsys: Capsys
) -> None:
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
