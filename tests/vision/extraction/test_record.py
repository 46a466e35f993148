"""An extraction in the store: what was found is what is read back."""

from pathlib import Path

import numpy as np
import sqlalchemy as sa

from relmodel.store.runs import Run
from relmodel.store.store import Store
from vision.extraction.extract import extract
from vision.extraction.record import record_extraction
from vision.images import Picture
from vision.input_rows import record_picture

from .synthetic import disc, sectors


def test_rows_are_the_columns(tmp_path: Path) -> None:
    grey = disc(60.3, 58.8, 30.0, (120, 120))
    found, picture = extract(grey), Picture("a.png", "ab", b"", 8, 1, grey)
    with Store.create(tmp_path / "store.duckdb") as store, Run.begin(store, "extract", {}) as run:
        with run.write() as connection:
            image = record_picture(run, connection, picture, keep_bytes=False)
            first = record_extraction(run, connection, image, "ab", found)
            assert record_extraction(run, connection, image, "ab", found) == first
        with store.read() as connection:

            def count(table: str) -> int:
                return int(connection.execute(sa.select(sa.func.count()).select_from(store.table(table))).scalar_one())

            assert count("extraction") == 1
            assert count("image_arc") == len(found.arcs) == 1
            assert count("image_region") == len(found.regions) == 2
            assert count("unit") == 3
            assert count("unit_relation") == len(found.relations)
            assert count("region_arc") == len(found.region_arcs) == 2
            arc = connection.execute(sa.select(store.table("image_arc"))).one()
            assert (arc.kind, arc.closed, arc.bright_side) == ("circular", True, "left")
            assert (arc.radius, arc.significance) == (found.arcs.radius[0], found.arcs.significance[0])
            polyline = connection.execute(sa.select(store.table("image_arc_polyline"))).one()
            np.testing.assert_allclose(polyline.x, found.arcs.x, atol=1e-4)
            np.testing.assert_allclose(polyline.sigma, found.arcs.point_sigma, rtol=1e-6)
            of_arc = connection.execute(sa.select(store.table("edge_element").c.arc_no)).scalars()
            assert set(of_arc) == {0}
            pixels = connection.execute(sa.select(store.table("region_topography").c.pixels)).scalars()
            assert sum(pixels) == 120 * 120


def test_ends_of_arcs_are_those_of_their_junctions(tmp_path: Path) -> None:
    grey = sectors((40.3, 38.8), [0.3, 1.7, 0.3 + np.pi], [180.0, 110.0, 40.0], (80, 80))
    found, picture = extract(grey), Picture("a.png", "ab", b"", 8, 1, grey)
    with Store.create(tmp_path / "store.duckdb") as store, Run.begin(store, "extract", {}) as run:
        with run.write() as connection:
            image = record_picture(run, connection, picture, keep_bytes=False)
            record_extraction(run, connection, image, "ab", found)
        with store.read() as connection:

            def rows(table: str) -> list[sa.Row[tuple[object, ...]]]:
                return list(connection.execute(sa.select(store.table(table))))

            (junction,) = rows("image_junction")
            arcs = {arc.arc_no: arc for arc in rows("image_arc")}
            courses = {course.arc_no: course for course in rows("image_arc_polyline")}
            met = [(row.arc_no, row.meets_with) for row in rows("image_junction_arc")]
    assert junction.kind == "T"
    assert np.hypot(junction.x - 40.3, junction.y - 38.8) < 0.05
    assert sorted(what for _, what in met)[0] == "course"
    (closed,) = [(arcs[arc], courses[arc], what) for arc, what in met if what != "course"]
    arc, course, what = closed
    assert (getattr(arc, f"{what}_x"), getattr(arc, f"{what}_y")) == (junction.x, junction.y)
    at = 0 if what == "start" else -1
    assert np.hypot(course.x[at] - junction.x, course.y[at] - junction.y) < 1e-4
