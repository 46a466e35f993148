"""Pictures that ask to be turned, made by the EXIF standard, against the upright one and OpenCV."""

from __future__ import annotations

import struct
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
import pytest
from PIL import Image
from sqlalchemy import text

from relmodel.app.cli.main import main
from relmodel.drawing.draw import read_image
from relmodel.errors import InputError
from relmodel.store import Store
from tests.vision.cameras.test_bits import tiff, with_chunk
from vision.cameras.cameras import Camera
from vision.cameras.images import describe_reading, read_picture

Pixels = npt.NDArray[np.generic]
UPRIGHT = np.kron(np.arange(6, dtype=np.uint8).reshape(3, 2) * 40 + 10, np.ones((16, 16), np.uint8))  # 48 x 32

# Where the first row and the first column of what is stored are in the picture (EXIF 2.3, tag 274).
FIRST = {
    1: ("top", "left"), 2: ("top", "right"), 3: ("bottom", "right"), 4: ("bottom", "left"),
    5: ("left", "top"), 6: ("right", "top"), 7: ("right", "bottom"), 8: ("left", "bottom"),
}  # fmt: skip


def store_by(orientation: int, upright: Pixels) -> Pixels:
    row, column = FIRST[orientation]
    across = row in ("left", "right")
    x, y = (row, column) if across else (column, row)
    out = upright[:: -1 if y == "bottom" else 1, :: -1 if x == "right" else 1]
    return out.swapaxes(0, 1) if across else out


def write_jpeg(path: Path, orientation: int) -> None:
    exif = Image.Exif()
    exif[274] = orientation
    Image.fromarray(store_by(orientation, UPRIGHT)).save(path, "JPEG", quality=100, exif=exif)


def write_png(path: Path, orientation: int, pixels: Pixels = UPRIGHT) -> None:
    path.write_bytes(cv2.imencode(".png", np.ascontiguousarray(store_by(orientation, pixels)))[1].tobytes())
    with_chunk(path, b"eXIf", b"II*\0" + struct.pack("<IHHHIHHI", 8, 1, 274, 3, 1, orientation, 0, 0))


def write_deep_png(path: Path, orientation: int) -> None:
    write_png(path, orientation, np.repeat(UPRIGHT[..., None].astype(np.uint16) * 257, 3, axis=2))


def write_tiff(path: Path, orientation: int, samples: int = 1, kind: type[np.unsignedinteger] = np.uint8) -> None:
    pixels = store_by(orientation, UPRIGHT).astype(kind) * (257 if kind is np.uint16 else 1)
    (rows, columns), bits = pixels.shape, np.dtype(kind).itemsize * 8
    tags = {256: columns, 257: rows, 258: bits, 259: 1, 262: 1 if samples == 1 else 2, 274: orientation}
    body = np.repeat(pixels[..., None], samples, axis=2).tobytes()
    path.write_bytes(tiff(tags | {277: samples, 278: rows}, body))


def write_deep_tiff(path: Path, orientation: int) -> None:
    write_tiff(path, orientation, 3, np.uint16)


@pytest.mark.parametrize("orientation", FIRST)
@pytest.mark.parametrize("write", [write_jpeg, write_png, write_deep_png, write_tiff, write_deep_tiff])
def test_a_picture_is_turned_as_it_asks(write: object, orientation: int, tmp_path: Path) -> None:
    assert callable(write)
    path = tmp_path / "a.img"
    write(path, orientation)
    picture = read_picture(path, Camera(32, 48, np.eye(3)))
    np.testing.assert_allclose(picture.grey, UPRIGHT, atol=2)
    assert picture.orientation == orientation
    by_opencv = cv2.imdecode(np.frombuffer(path.read_bytes(), np.uint8), cv2.IMREAD_GRAYSCALE)
    assert by_opencv is not None
    np.testing.assert_allclose(by_opencv, UPRIGHT, atol=2)
    shown = read_image(path.read_bytes())
    assert shown is not None
    drawn = np.asarray(shown.convert("L"), float)
    assert drawn.shape == UPRIGHT.shape
    assert np.corrcoef(drawn.ravel(), UPRIGHT.ravel())[0, 1] > 0.999
    notes = describe_reading([picture])
    assert any("EXIF" in words for words in notes) == (orientation > 1)


def test_the_size_of_the_camera_is_that_of_the_turned_picture(tmp_path: Path) -> None:
    write_jpeg(tmp_path / "a.jpg", 6)
    with pytest.raises(InputError, match="32x48, turned by 90 degrees clockwise as its EXIF orientation says, but"):
        read_picture(tmp_path / "a.jpg", Camera(48, 32, np.eye(3)))


@pytest.mark.parametrize("said", [0, 9, 65535])
def test_a_turn_that_is_none_is_none(said: int, tmp_path: Path) -> None:
    write_jpeg(tmp_path / "a.jpg", 1)
    exif = Image.Exif()
    exif[274] = said
    Image.fromarray(UPRIGHT).save(tmp_path / "a.jpg", exif=exif)
    assert read_picture(tmp_path / "a.jpg").orientation == 1


@pytest.mark.filterwarnings("ignore::UserWarning")
def test_a_damaged_note_does_not_cost_the_picture(tmp_path: Path) -> None:
    rng, path = np.random.default_rng(1), tmp_path / "a.jpg"
    write_jpeg(path, 3)
    whole = path.read_bytes()
    at = whole.index(b"Exif\0\0") + 6
    for _ in range(200):
        data = bytearray(whole)
        data[at : at + 24] = (
            rng.integers(0, 256, 24, dtype=np.uint8).tobytes() if rng.random() < 0.5 else whole[at : at + 24]
        )
        data[at + int(rng.integers(24))] = int(rng.integers(256))
        path.write_bytes(data)
        assert read_picture(path).grey.size == UPRIGHT.size
        assert read_image(bytes(data)) is not None


def test_a_run_says_that_a_picture_was_turned(
    duckdb_template: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    write_jpeg(tmp_path / "a.jpg", 8)
    write_jpeg(tmp_path / "b.jpg", 1)
    store = tmp_path / "cell.duckdb"
    store.write_bytes(duckdb_template.read_bytes())
    assert main(["extract", *(str(tmp_path / n) for n in ("a.jpg", "b.jpg")), "--store", str(store)]) == 0
    said = capsys.readouterr().err
    assert "a.jpg: turned by 90 degrees counterclockwise, as its EXIF orientation says" in said
    assert "b.jpg: " not in said.replace("b.jpg: extracting", "")
    with Store.open(str(store), read_only=True) as opened, opened.read() as connection:
        rows = connection.execute(text("SELECT file_name, orientation, width, height FROM image ORDER BY 1")).all()
    assert [tuple(row) for row in rows] == [("a.jpg", 8, 32, 48), ("b.jpg", None, 32, 48)]
