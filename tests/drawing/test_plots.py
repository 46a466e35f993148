"""Drawings against closed forms, and pictures against what they were made from."""

from __future__ import annotations

import base64
import io
import re

import numpy as np
import pytest
from PIL import Image

from relmodel.app.report.page import cell, script_json
from relmodel.drawing.draw import Balloon, Point, course, data_uri, draw_balloons, history, read_image, tolerance_bar


def test_a_course_keeps_its_ends_and_stays_near() -> None:
    at = np.linspace(0, 3, 400)
    x, y = 100 + 40 * np.cos(at), 80 + 40 * np.sin(at)
    assert course(np.array([[1.0, 2.0], [5.0, 2.0]])) == "M1.0 2.0L5.0 2.0"
    kept = np.array([[float(n) for n in p.split()] for p in re.split("[ML]", course(np.column_stack([x, y])))[1:]])
    assert len(kept) < 40
    np.testing.assert_allclose(kept[[0, -1]], [[x[0], y[0]], [x[-1], y[-1]]], atol=0.06)
    steps = np.linspace(0, 1, 50)[:, None, None]
    along = (kept[:-1] + steps * (kept[1:] - kept[:-1])).reshape(-1, 2)
    assert np.abs(np.hypot(along[:, 0] - 100, along[:, 1] - 80) - 40).max() < 0.5


def test_a_history_has_its_limits() -> None:
    """Each where its value lies; one value alone has its labels; a date stands where it is another than before."""
    points = [Point(f"/run/{n}", f"run {n}", 3.0 - n, "2026-01-31", upper=3.0) for n in (1, 2)]
    assert re.findall(r">([0-9-]{10})</text>", history(points, "mm")) == ["2026-01-31"]
    heights = [float(y) for y in re.findall(r'cy="([0-9.]+)"', history(points, "mm"))]
    (limit,) = re.findall(r'class="limit" d="M[0-9.]+ ([0-9.]+)L', history(points, "mm"))
    assert heights[0] - float(limit) == pytest.approx(heights[1] - heights[0], abs=0.11)
    both = history([Point("/run/1", "run 1", 2.0, nominal=2.5, lower=1.5, upper=3.0)], "mm")
    below, above = (float(y) for y in re.findall(r'class="limit" d="M[0-9.]+ ([0-9.]+)L', both))
    (nominal,) = re.findall(r'class="nominal" d="M[0-9.]+ ([0-9.]+)L', both)
    assert float(nominal) == pytest.approx(below + (above - below) * 2 / 3, abs=0.11)
    assert len(set(re.findall(r">([0-9.]+)</text>", history([Point("/run/1", "run 1", 2.0)], "mm")))) == 5
    assert history([Point("/run/1", "run 1", 2.0)] * 900, "mm").count("<circle") == 500


def test_balloons_lie_on_no_other_and_on_no_place() -> None:
    """Of places all over the picture, in its corners, and several at one."""
    size = np.array([1280, 960])
    places = np.random.default_rng(3).uniform(0, 1, (20, 2)) * size
    places[:4] = [[0, 0], [1279, 0], [640, 480], [640, 480]]
    drawn = draw_balloons([Balloon(f"F{n}", f"at-{n}", at, "changed") for n, at in enumerate(places)], (1280, 960))
    circles = np.array(re.findall(r'cx="([\d.-]+)" cy="([\d.-]+)" r="([\d.]+)"', drawn), float)
    there, put = circles[::2], circles[1::2]
    np.testing.assert_allclose(there[:, :2], places, atol=0.51)
    radius = put[0, 2]
    assert ((put[:, :2] > radius) & (put[:, :2] < size - radius)).all()
    apart = np.linalg.norm(put[:, None, :2] - put[None, :, :2], axis=2) + 1e3 * np.eye(20)
    assert apart.min() > 2 * radius
    assert np.linalg.norm(put[:, None, :2] - places, axis=2).min() > radius
    assert re.findall(r">(F\d+)</text>", drawn) == [f"F{n}" for n in range(20)]


def test_a_tolerance_has_its_value_in_scale() -> None:
    numbers = r'"band" x="(.*?)".* width="(.*?)" .*M(.*?) 7H(.*?)".*cx="(.*?)"'
    low, width, left, right, at = map(float, re.findall(numbers, tolerance_bar((-0.5, 1.0), 0.25, 0.1, 2.0))[0])
    scale = width / 1.5
    np.testing.assert_allclose([low, left, right, at], scale * np.array([-0.5, 0.15, 0.35, 0.25]), atol=0.11)
    assert 'class="band"' not in tolerance_bar((None, None), 0.1, 0.2, 1.0)


def encoded(array: np.ndarray, form: str) -> bytes:
    out = io.BytesIO()
    Image.fromarray(array).save(out, form)
    return out.getvalue()


def shown(data: bytes) -> str:
    picture = read_image(data)
    assert picture is not None
    return data_uri(picture)


def decoded(uri: str) -> np.ndarray:
    kind, _, data = uri.partition(",")
    assert kind == "data:image/webp;base64"
    with Image.open(io.BytesIO(base64.b64decode(data))) as opened:
        return np.asarray(opened.convert("L"), float)


def test_pictures_of_eight_and_sixteen_bits_look_alike() -> None:
    ramp = np.tile(np.linspace(0, 250, 640), (480, 1))
    eight = decoded(shown(encoded(ramp.astype(np.uint8), "PNG")))
    sixteen = decoded(shown(encoded((ramp * 16).astype(np.uint16), "PNG")))
    assert eight.shape == (480, 640)
    assert np.abs(eight - ramp).mean() < 3
    assert np.abs(sixteen - ramp * 255 / 250).mean() < 3


def test_large_pictures_are_made_smaller_and_broken_ones_left_out() -> None:
    assert decoded(shown(encoded(np.full((1000, 5000), 90, np.uint8), "PNG"))).shape == (410, 2048)
    assert read_image(b"no picture") is None
    assert read_image(encoded(np.zeros((600, 600), np.uint8), "PNG")[:200]) is None


def test_cells_are_visible_text_and_json_ends_no_script() -> None:
    assert cell("a\x1b\u202eb") == "a\\x1b\\u202eb"
    assert cell(0.123456789) == "0.123457"
    assert [cell(v) for v in (None, True, [1, 2.5])] == ["", "yes", "1, 2.5"]
    assert "<" not in script_json({"</script>": "<!--"})
