"""What later stages and the store take of an extraction: the curves that its rows state, and what is read back."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import fields, is_dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import pytest
import sqlalchemy as sa
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Floats
from relmodel.store.runs import Run
from relmodel.store.store import Store
from tests.vision.extraction.synthetic import disc, render, sectors
from vision.cameras.images import Picture
from vision.cameras.record import record_picture
from vision.extraction.arcs import FREE, KINDS
from vision.extraction.extract import Extraction, extract
from vision.extraction.extraction_parameters import ExtractionParameters
from vision.extraction.rows import content_key, make_primitives, make_rows, record_extraction
from vision.stereo.epipolar import pack_arcs

MEGABYTE = 1_000_000
TURN = 0.5


def turned(x: Floats, y: Floats) -> Floats:
    """Coordinates along the axes of the ellipse in the middle of the picture, px."""
    cosine, sine = np.cos(TURN), np.sin(TURN)
    return np.stack([(x - 70) * cosine + (y - 60) * sine, (y - 60) * cosine - (x - 70) * sine])


def distance(x: Floats, y: Floats) -> Floats:
    """Of a place from an ellipse of 40 by 22 px, to first order, positive inside."""
    u, v = turned(x, y)
    r = np.maximum(np.hypot(u / 40, v / 22), 1e-9)
    return np.asarray((1 - r) * r / np.maximum(np.hypot(u / 1600, v / 484), 1e-9))


def test_courses_run_along_the_ellipse_with_its_bright_side_at_the_left() -> None:
    found = make_primitives(extract(render(distance, (120, 140), 0.7, 60, 160)))
    assert [KINDS[kind] for kind in found.arcs.kind] == ["elliptic"]
    assert found.grey_range == pytest.approx(100, abs=1)
    points = found.courses.points
    assert len(points) > 150
    off = np.hypot(*(turned(*points.T) / [[40], [22]])) - 1
    np.testing.assert_allclose(off, 0, atol=0.01)
    walk, inward = np.roll(points, -1, axis=0) - points, [70, 60] - points
    at_left = inward[:, 0] * walk[:, 1] - inward[:, 1] * walk[:, 0] > 0  # y runs down
    assert (at_left == found.courses.bright_left).mean() > 0.95
    np.testing.assert_allclose(pack_arcs(found).contrast, np.where(found.courses.bright_left, 100, -100), rtol=0.1)


def test_rows_are_the_columns(duckdb_file: Path) -> None:
    grey = disc(60.3, 58.8, 30.0, (120, 120))
    found, picture = extract(grey), Picture("a.png", "ab", b"", 8, grey)
    with Store.open(duckdb_file) as store, Run.begin(store, "extract", {}) as run:
        with run.write() as connection:
            image = record_picture(run, connection, picture, keep_bytes=False)
            first = record_extraction(run, connection, image, picture, found.parameters, make_rows(found))
            assert record_extraction(run, connection, image, picture, found.parameters, make_rows(found)) == first
        with store.read() as connection:

            def count(table: str) -> int:
                return int(connection.execute(sa.select(sa.func.count()).select_from(store.table(table))).scalar_one())

            assert (count("extraction"), count("unit")) == (1, 3)
            assert count("image_arc") == len(found.arcs) == 1
            assert count("image_region") == len(found.regions) == 2
            assert count("unit_relation") == len(found.relations)
            assert count("region_arc") == len(found.region_arcs) == 2
            arc = connection.execute(sa.select(store.table("image_arc"))).one()
            assert (arc.kind, arc.closed) == ("circular", True)
            assert arc.radius == found.arcs.radius[0]
            assert arc.significance == np.float32(found.arcs.significance[0])
            elements = connection.execute(sa.select(store.table("edge_element")).order_by("edge_element_no")).all()
            assert [element.edge_element_no for element in elements] == list(range(len(found.arcs.elements)))
            places = np.array([(element.x, element.y) for element in elements], float)
            np.testing.assert_allclose(places[:, 0], found.edges.x[found.arcs.elements], atol=0.0050001)
            np.testing.assert_allclose(np.hypot(*(places - (60.3, 58.8)).T), 30.0, atol=0.2)
            assert count("image_arc_point") == 0
            outline = store.table("region_outline")
            assert connection.execute(sa.select(outline.c.x).where(outline.c.region_no == 0)).scalars().all() == [
                int(x)
                for x in found.regions.outline_x[: found.regions.ring_offsets[sum(found.regions.ring_region == 0)]]
            ]
            of_arc = connection.execute(sa.select(store.table("edge_element").c.image_arc_no)).scalars()
            assert set(of_arc) == {0}


def recorded(file: Path, grey: Floats, found: Extraction) -> dict[str, list[Any]]:
    """The rows of arcs and junctions that are stored of an extraction."""
    picture = Picture("a.png", "ab", b"", 8, grey)
    with Store.open(file) as store, Run.begin(store, "extract", {}) as run:
        with run.write() as connection:
            image = record_picture(run, connection, picture, keep_bytes=False)
            record_extraction(run, connection, image, picture, found.parameters, make_rows(found))
        names = ("image_arc", "image_arc_point", "image_junction", "image_junction_arc")
        with store.read() as connection:
            return {name: list(connection.execute(sa.select(store.table(name)))) for name in names}


def test_ends_of_arcs_are_those_of_their_junctions(duckdb_file: Path) -> None:
    grey = sectors((40.3, 38.8), [0.3, 1.7, 0.3 + np.pi], [180.0, 110.0, 40.0], (80, 80))
    found = extract(grey)
    alike = np.array([[[4.96500576e8, 1.17531866e8], [1.17531866e8, 2.78222024e7]]])  # of arcs that run nearly alike
    found = replace(found, junctions=replace(found.junctions, covariance=alike))
    rows = recorded(duckdb_file, grey, found)
    (junction,) = rows["image_junction"]
    arcs = {arc.image_arc_no: arc for arc in rows["image_arc"]}
    met = [(row.image_arc_no, row.meets_with) for row in rows["image_junction_arc"]]
    assert (junction.kind, np.hypot(junction.x - 40.3, junction.y - 38.8) < 0.05) == ("T", True)
    assert "interior" in {what for _, what in met}
    ((arc_no, what),) = [(arc, what) for arc, what in met if what != "interior"]
    arc = arcs[arc_no]
    assert (getattr(arc, f"{what}_x"), getattr(arc, f"{what}_y")) == (junction.x, junction.y)


def test_a_free_arc_has_a_course(duckdb_file: Path) -> None:
    grey = disc(60.3, 58.8, 30.0, (120, 120))
    found = extract(grey)
    found = replace(found, arcs=replace(found.arcs, kind=np.array([FREE], np.int8)))
    points = sorted(recorded(duckdb_file, grey, found)["image_arc_point"], key=lambda row: row.point_no)
    assert [point.point_no for point in points] == list(range(len(found.arcs.x)))
    polyline = np.array([(point.x, point.y, point.sigma) for point in points], float)
    np.testing.assert_allclose(np.hypot(*(polyline[:, :2] - (60.3, 58.8)).T), 30.0, atol=0.05)
    assert (polyline[:, 2] < 0.1).all()


def crowded_picture() -> Floats:
    """1280x960 pixels with discs and tilted squares in turn: as many edge elements, arcs and regions as a bulkhead."""
    y, x = np.mgrid[:80, :80] - 39.5
    shapes = np.hypot(x, y) < 28, (abs(x + 0.3 * y) < 26) & (abs(y - 0.3 * x) < 26)
    cells = [[np.where(shapes[(row + column) % 2], 180.0, 60.0) for column in range(16)] for row in range(12)]
    noise = np.random.default_rng(0).normal(0.0, 1.5, (960, 1280))
    return np.asarray(np.rint(gaussian_filter(np.block(cells), 0.8) + noise))


def test_a_picture_takes_less_than_3_mb_of_the_file(duckdb_file: Path) -> None:
    """Each of several, its own bytes too, stored by processes one after the other: each ends with a checkpoint."""
    grey, path = crowded_picture(), duckdb_file
    found = extract(grey)
    assert len(found.chains.elements) > 25_000
    assert len(found.arcs) > 400
    assert len(found.relations) > 4000
    data = cv2.imencode(".png", grey.astype(np.uint8))[1].tobytes()
    assert len(data) > 590_000
    sizes = [path.stat().st_size]
    for number in range(3):
        with Store.open(path) as store, Run.begin(store, "extract", {}) as run, run.write() as connection:
            picture = Picture(f"{number}.png", str(number), data, 8, grey)
            image = record_picture(run, connection, picture, keep_bytes=True)
            record_extraction(run, connection, image, picture, found.parameters, make_rows(found))
        sizes.append(path.stat().st_size)
    assert not Path(f"{path}.wal").exists()
    grown = np.diff(sizes) / MEGABYTE
    assert grown.max() <= 3, grown
    assert grown.mean() <= 2.5, grown


def _changed(parameters: Any) -> Iterator[Any]:
    """The parameters with one number or word changed, each of them in turn."""
    for field in fields(parameters):
        value = getattr(parameters, field.name)
        if is_dataclass(value):
            yield from (replace(parameters, **{field.name: other}) for other in _changed(value))
        elif isinstance(value, tuple):
            yield replace(parameters, **{field.name: (*value[:-1], value[-1] + 0.125)})
        elif isinstance(value, str):
            yield replace(parameters, **{field.name: "plain" if value else "0123"})
        else:
            yield replace(parameters, **{field.name: value / 2})


def test_the_key_of_an_extraction_depends_on_the_bits_and_each_parameter() -> None:
    plain = ExtractionParameters()
    others = list(_changed(plain))
    assert len(others) > 100
    picture = Picture("a.png", "ab", b"", 16, np.zeros((1, 1)), 16)
    of_bits = [content_key(replace(picture, bits=bits), plain) for bits in (8, 10, 12, 14)]
    assert len({*of_bits, *(content_key(picture, p) for p in [plain, *others])}) == 5 + len(others)
    recorded = json.loads(plain.to_json())
    assert recorded["edges"]["scale"] == 1.4
    assert list(recorded) == sorted(recorded)
