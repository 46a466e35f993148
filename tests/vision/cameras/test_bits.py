"""Pictures of cameras of 8 to 16 bits in files of sixteen, each written as programs do, against the scene they show."""

from __future__ import annotations

import struct
import zlib
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from scipy.spatial import cKDTree

from relmodel.arrays import Floats
from relmodel.errors import InputError
from vision.cameras.cameras import Camera, Rig
from vision.cameras.images import describe_reading, read_picture, read_pictures
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives

DEMO = Path(__file__).parents[3] / "examples/demo"
CAMERA = Camera(64, 48, np.array([[80.0, 0, 31.5], [0, 80, 23.5], [0, 0, 1]]))


@pytest.fixture(scope="module")
def scene() -> Floats:
    """Light (48, 64) of 0 to 1, both met."""
    light = np.random.default_rng(1).uniform(0, 1, (48, 64))
    light[0, :2] = 0, 1
    return light


def counts(light: Floats, bits: int) -> npt.NDArray[np.uint16]:
    return np.asarray(np.rint(light * (2**bits - 1)), np.uint16)


def save(path: Path, light: Floats, bits: int, *, shift: int = 0) -> Path:
    Image.fromarray(counts(light, bits) << shift).save(path)
    return path


def with_significant_bits(path: Path, *bits: int) -> Path:
    return with_chunk(path, b"sBIT", bytes(bits))


def test_eight_bits_are_as_they_are(scene: Floats, tmp_path: Path) -> None:
    Image.fromarray(counts(scene, 8).astype(np.uint8)).save(tmp_path / "a.png")
    picture = read_picture(with_significant_bits(tmp_path / "a.png", 5))
    assert (picture.depth, picture.bits, picture.bits_from) == (8, 8, "file")
    assert np.array_equal(picture.grey, counts(scene, 8))
    assert describe_reading([picture]) == []


def of_twelve_packed(path: Path, light: Floats) -> None:
    """A TIFF of three bytes for two pixels."""
    first, second = counts(light, 12).reshape(-1, 2).astype(int).T
    packed = np.stack([first >> 4, (first & 15) << 4 | second >> 8, second & 255], axis=1).astype(np.uint8).tobytes()
    rows, columns = light.shape
    path.write_bytes(tiff({256: columns, 257: rows, 258: 12, 259: 1, 262: 1, 277: 1, 278: rows}, packed))


def tiff(tags: dict[int, int], body: bytes) -> bytes:
    """A TIFF of one strip; several samples have equal bits, of which tag 258 gives the number."""
    samples, place = tags[277], 8 + 2 + 12 * (len(tags) + 2) + 4
    bits = struct.pack(f"<{samples}H", *[tags[258]] * samples) if samples > 1 else b""
    tags = tags | {273: place + len(bits), 279: len(body)} | ({258: place} if bits else {})
    entries = [struct.pack("<HHII", n, 3 if n == 258 else 4, samples if n == 258 else 1, tags[n]) for n in sorted(tags)]
    return b"II*\0" + struct.pack("<IH", 8, len(tags)) + b"".join(entries) + bytes(4) + bits + body


def with_chunk(path: Path, name: bytes, body: bytes) -> Path:
    """A PNG with one chunk more, after its head."""
    data = path.read_bytes()
    chunk = struct.pack(">I", len(body)) + name + body + struct.pack(">I", zlib.crc32(name + body))
    path.write_bytes(data[:33] + chunk + data[33:])
    return path


def pgm(path: Path, light: Floats) -> None:
    head = b"P5\n# a camera\n%d %d\n4095\n" % light.shape[::-1]
    path.write_bytes(head + counts(light, 12).astype(">u2").tobytes())


def tagged(tag: int, most: int) -> Callable[[Path, Floats], None]:
    return lambda path, light: Image.fromarray(counts(light, 12)).save(path, tiffinfo={tag: most})


STATED: dict[str, tuple[str, int, Callable[[Path, Floats], object]]] = {
    "sBIT": ("png", 12, lambda path, light: with_significant_bits(save(path, light, 12), 12)),
    "sBIT, shifted up as the standard has it": (
        "png", 16, lambda path, light: with_significant_bits(save(path, light, 12, shift=4), 12)
    ),
    "BitsPerSample": ("tif", 12, of_twelve_packed),
    "MaxSampleValue": ("tif", 12, tagged(281, 4095)),
    "SMaxSampleValue": ("tif", 12, tagged(341, 4000)),
    "WhiteLevel": ("tif", 12, tagged(50717, 4095)),
    "maximum of a PGM": ("pgm", 16, pgm),
}  # fmt: skip


@pytest.mark.parametrize("what", STATED)
def test_a_dark_picture_is_as_dark_as_its_file_says(what: str, scene: Floats, tmp_path: Path) -> None:
    suffix, bits, put = STATED[what]
    path, light = tmp_path / f"dark.{suffix}", 0.2 * scene  # values of ten bits
    put(path, light)
    picture = read_picture(path)
    assert (picture.bits, picture.bits_from) == (bits, "file")
    np.testing.assert_allclose(picture.grey, 255 * light, atol=0.05)


def test_what_a_file_says_is_passed_over_where_its_values_are_greater(scene: Floats, tmp_path: Path) -> None:
    Image.fromarray(counts(scene, 12)).save(tmp_path / "a.tif", tiffinfo={281: 900})
    picture = read_picture(tmp_path / "a.tif")
    assert (picture.bits, picture.bits_from) == (12, "values")


@pytest.mark.parametrize("alpha", [False, True])
def test_colours_have_the_bits_of_the_greatest_and_alpha_has_none(alpha: bool, scene: Floats, tmp_path: Path) -> None:
    light = np.dstack([scene, scene[::-1], 0.1 * scene])
    values = counts(light[..., ::-1], 12)
    cv2.imwrite(str(tmp_path / "a.png"), np.dstack([values, np.full(scene.shape, 65535, np.uint16)][: 1 + alpha]))
    picture = read_picture(tmp_path / "a.png")
    assert picture.bits == 12
    np.testing.assert_allclose(picture.grey, 255 * light @ [0.299, 0.587, 0.114], atol=0.04)


def test_pictures_of_one_pair_have_the_bits_of_the_brighter(scene: Floats, tmp_path: Path) -> None:
    paths = {"left": save(tmp_path / "l.png", 0.2 * scene, 12), "right": save(tmp_path / "r.png", scene, 12)}
    rig = Rig(dict.fromkeys(paths, CAMERA), dict.fromkeys(paths, np.eye(4)))
    assert read_picture(paths["left"], CAMERA).bits == 10
    pair = read_pictures(paths, rig)
    assert [picture.bits for picture in pair.values()] == [12, 12]
    np.testing.assert_allclose(pair["left"].grey, 255 * 0.2 * scene, atol=0.04)
    with_significant_bits(paths["left"], 11)
    assert [picture.bits for picture in read_pictures(paths, rig).values()] == [11, 12]


def test_the_rig_says_first_how_many_bits_a_camera_has(scene: Floats, tmp_path: Path) -> None:
    path = with_significant_bits(save(tmp_path / "a.png", 0.01 * scene, 16), 12)
    assert read_picture(path, CAMERA).bits == 12
    picture = read_picture(path, replace(CAMERA, bits=16))
    assert (picture.bits, picture.bits_from) == (16, "rig")
    np.testing.assert_allclose(picture.grey, 2.55 * scene, atol=0.01)
    with pytest.raises(InputError, match=r"has values of 10 bits, but its camera in the rig has 9: correct"):
        read_picture(path, replace(CAMERA, bits=9))


def test_arcs_and_regions_of_a_scene_do_not_depend_on_the_bits(tmp_path: Path) -> None:
    grey = read_picture(DEMO / "pair_00_left.png").grey[300:620, 400:800]
    plain = make_primitives(extract(grey))
    found = make_primitives(extract(read_picture(save(tmp_path / "a.png", grey / 255, 12)).grey))
    assert (len(plain.arcs), len(plain.regions)) == (29, 28)
    assert abs(len(found.arcs) - 29) <= 1
    assert abs(len(found.regions) - 28) <= 2
    places = [np.column_stack([it.elements.x, it.elements.y]) for it in (plain, found)]
    assert np.mean(cKDTree(places[1]).query(places[0])[0] < 0.05) > 0.99


def test_colours_of_sixteen_bits_in_a_netpbm_file_are_not_cut_to_eight(scene: Floats, tmp_path: Path) -> None:
    values = np.repeat(counts(scene, 16)[..., None], 3, axis=2)
    (tmp_path / "a.ppm").write_bytes(b"P6\n# by hand\n64 48\n65535\n" + values.astype(">u2").tobytes())
    picture = read_picture(tmp_path / "a.ppm")
    assert picture.depth == 16
    assert np.abs(picture.grey - 255 * scene).max() < 0.01
