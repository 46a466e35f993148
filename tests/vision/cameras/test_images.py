"""Pictures given as arrays and files, and how many bits their values fill."""

from __future__ import annotations

import hashlib
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest

from relmodel.errors import InputError, UsageError
from tests.vision.localisation.scenes import stereo_rig
from vision.cameras.images import (
    PictureBytes,
    digest_given,
    encode_array,
    find_bits,
    name_pictures,
    pictures_as_files,
    read_mask,
    read_picture,
)


@pytest.mark.parametrize(
    ("values", "stated", "of_rig", "found"),
    [
        ([255], (), None, (8, "values")),
        ([256], (), None, (10, "values")),
        ([1023], (), None, (10, "values")),
        ([1025], (), None, (12, "values")),
        ([4097], (), None, (14, "values")),
        ([16385], (), None, (16, "values")),
        ([1023 << 2], (), None, (16, "values")),  # ten bits, shifted up
        ([819 << 4], (), None, (16, "values")),  # twelve, of a dark picture: as large as fourteen
        ([255 << 2], (), None, (10, "values")),  # eight: may be as it is
        ([255 << 4], (), None, (12, "values")),
        ([1023 << 1], (), None, (12, "values")),  # by one only
        ([1023], (9, 16), None, (16, "file")),
        ([511], (9, 16), None, (9, "file")),
        ([1023], (9,), None, (10, "values")),
        ([1023], (16,), 12, (12, "rig")),
        ([1023], (16,), 10, (10, "rig")),
    ],
)
def test_bits_are_those_of_the_rig_or_the_file_or_the_values(
    values: list[int], stated: tuple[int, ...], of_rig: int | None, found: tuple[int, str]
) -> None:
    assert find_bits(np.array([[0, *values]], np.uint16), stated, of_rig, "x") == found
    rgba = np.array([[[v, 0, 0, 2**16 - 1] for v in (0, *values)]], np.uint16)
    assert find_bits(rgba, stated, of_rig, "x") == found
    with pytest.raises(InputError, match="correct bits"):
        find_bits(np.array([[1024]], np.uint16), (), 10, "x")


@pytest.mark.parametrize("shape", [(3, 5), (3, 5, 1), (3, 5, 3), (3, 5, 4)])
@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.float32])
def test_arrays_come_back_as_luminance(shape: tuple[int, ...], kind: Any) -> None:
    most = {np.uint8: 255, np.uint16: 2**16 - 1, np.float32: 1.0}[kind]
    values = (np.random.default_rng(1).uniform(0, 0.2, shape) * most).astype(kind)
    found = read_picture(PictureBytes("x.png", encode_array(values, "left")))
    scale = 2**16 - 1 if kind == np.float32 else 1
    plain = np.rint(values.astype(float) * scale)
    expected = plain.reshape(3, 5) if plain.size == 15 else plain[..., :3] @ [0.299, 0.587, 0.114]
    np.testing.assert_allclose(found.values, expected, atol=1e-9)
    assert (found.depth, found.width, found.height) == (8 if kind == np.uint8 else 16, 5, 3)
    if kind == np.float32:
        assert (found.bits, found.bits_from) == (16, "file")
        np.testing.assert_allclose(found.grey, expected / 257, atol=1e-9)


def test_arrays_that_are_no_pictures_and_too_many_pictures_are_refused() -> None:
    for wrong in (np.zeros((3, 5, 2)), np.zeros((0, 5)), np.zeros(5), np.full((3, 5), 1.1), np.full((3, 5), -0.1)):
        with pytest.raises(InputError, match="the array of camera 'a'"):
            encode_array(wrong, "a")
    with pytest.raises(InputError, match="int32"):
        encode_array(np.zeros((3, 5), np.int32), "")
    grey = np.zeros((3, 5), np.uint8)
    assert len(pictures_as_files({str(k): grey for k in range(16)})) == 16
    for count in (0, 17):
        with pytest.raises(UsageError, match="1 to 16"):
            pictures_as_files({str(k): grey for k in range(count)})
    assert pictures_as_files("a.png") == {"": Path("a.png")}
    given = pictures_as_files(grey)[""]
    assert isinstance(given, PictureBytes)
    assert given.name == "picture.png"


def test_pictures_are_those_of_the_cameras_in_their_order_and_known_by_their_bytes(tmp_path: Path) -> None:
    rig, one = stereo_rig(), PictureBytes("x.png", b"some")
    assert list(name_pictures({"right": one, "left": one}, rig)) == ["left", "right"]
    assert list(name_pictures({"": one}, rig.only("right"))) == ["right"]
    with pytest.raises(UsageError, match="without the name"):
        name_pictures({"": one}, rig)
    with pytest.raises(UsageError, match="without the name"):
        name_pictures({"": one, "right": one}, rig.only("right"))
    with pytest.raises(InputError, match="no camera 'top'"):
        name_pictures({"top": one}, rig)
    for name in ("rig.yaml", "prior.yaml", "left.png"):
        (tmp_path / name).write_text(name)
    files: dict[str, Path | PictureBytes] = {"left": tmp_path / "left.png", "prior": one, "": one}
    found = digest_given(files, tmp_path / "rig.yaml", prior=tmp_path / "prior.yaml")
    names = {"left": "left.png", "rig": "rig.yaml", "prior": "prior.yaml"}
    digest = {role: (name, hashlib.sha256(name.encode()).hexdigest()) for role, name in names.items()}
    some = ("x.png", hashlib.sha256(b"some").hexdigest())
    assert {role: (Path(n).name, d) for role, (n, d) in found.items()} == digest | {
        "camera prior": some,
        "camera": some,
    }


def test_a_mask_is_what_is_brighter_than_half(tmp_path: Path) -> None:
    cv2.imwrite(str(tmp_path / "mask.png"), np.array([[127, 128, 0, 255]], np.uint8))
    assert read_mask(tmp_path / "mask.png").tolist() == [[False, True, False, True]]
    cv2.imwrite(str(tmp_path / "dark.png"), np.array([[127]], np.uint8))
    with pytest.raises(InputError, match="nowhere brighter"):
        read_mask(tmp_path / "dark.png")
