"""What else finds the boxes that meet a box, each behind the same few calls; answers are equal, to the last bit.

`one` gives the numbers of the boxes that meet a box, `any` whether there is one, `many` how many pairs some boxes
make, all pairs fetched.  Peers that keep bounds in 32 bits, rounded outward, carry the exact ones along, or look at
those of what they found.  Scans have their rows in the order of the pages that this project's store has, so that what
they skip by bounds of row groups is what the store skips.
"""

from __future__ import annotations

import ctypes
import os
import shutil
import sqlite3
import subprocess
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import duckdb
import numpy as np
import numpy.typing as npt
import shapely

from relmodel.find.boxes import page_order
from relmodel.find.indexes import BoxIndex, build
from relmodel.find.volumes import Frustum, VolumeTable, boxes_met

Floats = npt.NDArray[np.float64]
COLUMNS = ("x0", "y0", "z0", "x1", "y1", "z1")

SCAN = "SELECT id FROM boxes WHERE x0 <= $4 AND y0 <= $5 AND z0 <= $6 AND x1 >= $1 AND y1 >= $2 AND z1 >= $3"
JOIN = (
    "SELECT a.id AS asked, b.id AS found FROM asked AS a JOIN boxes AS b "
    "ON b.x0 <= a.x1 AND b.y0 <= a.y1 AND b.z0 <= a.z1 AND b.x1 >= a.x0 AND b.y1 >= a.y0 AND b.z1 >= a.z0"
)
SQLITE_LEAN = "SELECT id FROM boxes WHERE x0 <= ? AND x1 >= ? AND y0 <= ? AND y1 >= ? AND z0 <= ? AND z1 >= ?"
SQLITE = SQLITE_LEAN + " AND a <= ? AND d >= ? AND b <= ? AND e >= ? AND c <= ? AND f >= ?"
SQLITE_JOIN = (
    "SELECT q.rowid, b.id FROM asked AS q JOIN boxes AS b ON b.x0 <= q.x1 AND b.x1 >= q.x0 AND b.y0 <= q.y1 AND "
    "b.y1 >= q.y0 AND b.z0 <= q.z1 AND b.z1 >= q.z0"
)
EXACT = " AND b.a <= q.x1 AND b.d >= q.x0 AND b.b <= q.y1 AND b.e >= q.y0 AND b.c <= q.z1 AND b.f >= q.z0"


def within(view: Frustum, boxes: Floats, found: Any) -> Any:
    """Those of the boxes found about a view that meet it: what a peer that knows only boxes leaves to do."""
    met = boxes_met(view, np.broadcast_to(np.eye(4), (len(found), 4, 4)), boxes[found])
    return found[met]


class Peer:
    """What peers have in common: a view is the box about it, then its faces."""

    name: str
    boxes: Floats

    def one(self, box: Floats) -> Any:
        raise NotImplementedError

    def any(self, box: Floats) -> bool:
        return len(self.one(box)) > 0

    def view(self, view: Frustum) -> Any:
        return within(view, self.boxes, np.asarray(self.one(view.bounds)))

    @property
    def nbytes(self) -> int | None:
        return None


class Kind(Peer):
    """One of this project's, in process."""

    def __init__(self, boxes: Floats, kind: str) -> None:
        self.name = kind
        self.index: BoxIndex = build(kind, boxes)

    @property
    def nbytes(self) -> int:
        return self.index.nbytes

    def one(self, box: Floats) -> Any:
        return self.index.in_box(box)

    def any(self, box: Floats) -> bool:
        return self.index.any_in_box(box)

    def many(self, boxes: Floats) -> int:
        return len(self.index.in_boxes(boxes)[0])

    def view(self, view: Frustum) -> Any:
        return self.index.in_volumes(VolumeTable.of([view]))[1]


class Sqlite(Peer):
    name = "SQLite R*Tree"

    def __init__(self, boxes: Floats) -> None:
        self.boxes = boxes
        self.database = sqlite3.connect(":memory:")
        self.database.execute(
            "CREATE VIRTUAL TABLE boxes USING rtree(id, x0, x1, y0, y1, z0, z1, +a, +b, +c, +d, +e, +f)"
        )
        rows = np.column_stack([np.arange(len(boxes)), boxes[:, [0, 3, 1, 4, 2, 5]], boxes]).tolist()
        self.database.executemany("INSERT INTO boxes VALUES (?,?,?,?,?,?,?,?,?,?,?,?,?)", rows)

    @property
    def nbytes(self) -> int:
        pages, size = (self.database.execute(f"PRAGMA page_{what}").fetchone()[0] for what in ("count", "size"))
        return int(pages * size)

    def one(self, box: Floats) -> Any:
        asked = [*box[[3, 0, 4, 1, 5, 2]].tolist()] * 2
        return np.array([row[0] for row in self.database.execute(SQLITE, asked)], np.int64)

    def any(self, box: Floats) -> bool:
        asked = [*box[[3, 0, 4, 1, 5, 2]].tolist()] * 2
        return self.database.execute(SQLITE + " LIMIT 1", asked).fetchone() is not None

    def _ask(self, boxes: Floats) -> None:
        """Fill the table asked: row 1 is the first box."""
        self.database.execute("DROP TABLE IF EXISTS asked")
        self.database.execute("CREATE TEMP TABLE asked (x0, y0, z0, x1, y1, z1)")
        self.database.executemany("INSERT INTO asked VALUES (?,?,?,?,?,?)", boxes.tolist())

    def many(self, boxes: Floats) -> int:
        self._ask(boxes)
        return len(self.database.execute(SQLITE_JOIN + EXACT).fetchall())


class LeanSqlite(Sqlite):
    """Of bounds in 32 bits alone: what is found is held against the exact ones outside."""

    name = "lean R*Tree"

    def __init__(self, boxes: Floats) -> None:
        self.boxes = boxes
        self.database = sqlite3.connect(":memory:")
        self.database.execute("CREATE VIRTUAL TABLE boxes USING rtree(id, x0, x1, y0, y1, z0, z1)")
        rows = zip(range(len(boxes)), *boxes[:, [0, 3, 1, 4, 2, 5]].T.tolist(), strict=True)
        self.database.executemany("INSERT INTO boxes VALUES (?,?,?,?,?,?,?)", rows)

    def one(self, box: Floats) -> Any:
        rows = self.database.execute(SQLITE_LEAN, box[[3, 0, 4, 1, 5, 2]].tolist()).fetchall()
        found = np.array([row[0] for row in rows], np.int64)
        return found[_meet(self.boxes[found], box)]

    def any(self, box: Floats) -> bool:
        rows = self.database.execute(SQLITE_LEAN, box[[3, 0, 4, 1, 5, 2]].tolist())
        return any(bool(_meet(self.boxes[list(row)], box).any()) for row in rows)

    def many(self, boxes: Floats) -> int:
        self._ask(boxes)
        pairs = np.array(self.database.execute(SQLITE_JOIN).fetchall(), np.int64).reshape(-1, 2)
        return int(_meet(self.boxes[pairs[:, 1]], boxes[pairs[:, 0] - 1]).sum())


def _meet(boxes: Floats, asked: Floats) -> npt.NDArray[np.bool_]:
    """Whether each of some boxes (n, 6) meets the box asked, one or one each."""
    return np.asarray(((boxes[:, :3] <= asked[..., 3:]) & (boxes[:, 3:] >= asked[..., :3])).all(axis=1))


class Libspatialindex(Peer):
    name = "libspatialindex"

    def __init__(self, boxes: Floats) -> None:
        from rtree.index import Index, Property

        self.boxes = boxes
        stream = ((i, tuple(box), None) for i, box in enumerate(boxes.tolist()))
        self.index = Index(stream, properties=Property(dimension=3), interleaved=True)

    def one(self, box: Floats) -> Any:
        return np.fromiter(self.index.intersection(box.tolist()), np.int64)

    def many(self, boxes: Floats) -> int:
        return len(self.index.intersection_v(boxes[:, :3], boxes[:, 3:])[0])


class Shapely(Peer):
    name = "shapely STRtree, z"

    def __init__(self, boxes: Floats) -> None:
        self.boxes = boxes
        self.z0, self.z1 = boxes[:, 2].copy(), boxes[:, 5].copy()
        self.tree = shapely.STRtree(shapely.box(boxes[:, 0], boxes[:, 1], boxes[:, 3], boxes[:, 4]))

    def one(self, box: Floats) -> Any:
        found = self.tree.query(shapely.box(box[0], box[1], box[3], box[4]))
        return found[(self.z0[found] <= box[5]) & (self.z1[found] >= box[2])]

    def many(self, boxes: Floats) -> int:
        asked, found = self.tree.query(shapely.box(boxes[:, 0], boxes[:, 1], boxes[:, 3], boxes[:, 4]))
        return int(((self.z0[found] <= boxes[asked, 5]) & (self.z1[found] >= boxes[asked, 2])).sum())


class GeoIndex(Peer):
    """A flatbush in Rust, over x and y, then z."""

    name = "geoindex-rs, z"

    def __init__(self, boxes: Floats) -> None:
        self.boxes = boxes
        self.z0, self.z1 = boxes[:, 2].copy(), boxes[:, 5].copy()
        self.tree = self._built(boxes)

    @staticmethod
    def _built(boxes: Floats) -> Any:
        from geoindex_rs.rtree import RTreeBuilder

        builder = RTreeBuilder(len(boxes))
        builder.add(*(np.ascontiguousarray(boxes[:, i]) for i in (0, 1, 3, 4)))
        return builder.finish()

    def one(self, box: Floats) -> Any:
        from geoindex_rs.rtree import search

        found = np.asarray(search(self.tree, box[0], box[1], box[3], box[4]))
        return found[(self.z0[found] <= box[5]) & (self.z1[found] >= box[2])]

    def many(self, boxes: Floats) -> int:
        from geoindex_rs.rtree import tree_join

        pairs = tree_join(self._built(boxes), self.tree)
        asked, found = np.asarray(pairs["left"]), np.asarray(pairs["right"])
        return int(((self.z0[found] <= boxes[asked, 5]) & (self.z1[found] >= boxes[asked, 2])).sum())


class Vtk(Peer):
    """VTK's static cell locator over the boxes' diagonals, whose bounds they are; it gives the cells of all its bins
    that a box meets, and the bounds decide."""

    name = "VTK locator"

    def __init__(self, boxes: Floats) -> None:
        from vtkmodules.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray
        from vtkmodules.vtkCommonCore import vtkIdList, vtkPoints
        from vtkmodules.vtkCommonDataModel import vtkCellArray, vtkPolyData, vtkStaticCellLocator

        self.boxes, self.found = boxes, vtkIdList()
        self.points, lines = vtkPoints(), vtkCellArray()
        self.points.SetData(numpy_to_vtk(boxes.reshape(-1, 3)))
        corners = np.arange(2 * len(boxes) + 1)
        lines.SetData(*(numpy_to_vtkIdTypeArray(ids, deep=True) for ids in (corners[::2], corners[:-1])))
        data = vtkPolyData()
        data.SetPoints(self.points)
        data.SetLines(lines)
        self.tree = vtkStaticCellLocator()
        self.tree.SetDataSet(data)
        self.tree.BuildLocator()

    def one(self, box: Floats) -> Any:
        self.tree.FindCellsWithinBounds(box[[0, 3, 1, 4, 2, 5]].tolist(), self.found)
        count = self.found.GetNumberOfIds()
        if not count:
            return np.empty(0, np.int64)
        at = int(self.found.GetPointer(0).split("_")[1], 16)  # taken one by one they would cost much more
        found = np.ctypeslib.as_array((ctypes.c_int64 * count).from_address(at))
        return found[_meet(self.boxes[found], box)]

    def many(self, boxes: Floats) -> int:
        return sum(len(self.one(box)) for box in boxes)


class NumpyScan(Peer):
    """All boxes looked at, column by column, in as few passes as they allow."""

    name = "NumPy scan"

    def __init__(self, boxes: Floats) -> None:
        self.boxes = boxes
        self.number = page_order(boxes)
        self.columns = np.ascontiguousarray(boxes[self.number].T)

    @property
    def nbytes(self) -> int:
        return self.columns.nbytes

    def one(self, box: Floats) -> Any:
        x0, y0, z0, x1, y1, z1 = self.columns
        met = (x0 <= box[3]) & (x1 >= box[0])
        for low, high, axis in ((y0, y1, 1), (z0, z1, 2)):
            met &= low <= box[3 + axis]
            met &= high >= box[axis]
        return self.number[met]

    def many(self, boxes: Floats) -> int:
        return sum(len(self.one(box)) for box in boxes)


class Scan(Peer):
    name = "DuckDB scan"

    def __init__(self, boxes: Floats) -> None:
        self.boxes = boxes
        self.database = duckdb.connect()
        order = page_order(boxes)
        self.database.register("incoming", _arrow(boxes[order], order))
        self.database.execute("CREATE TABLE boxes AS SELECT * FROM incoming")

    @property
    def nbytes(self) -> int:
        return len(self.boxes) * 7 * 8

    def one(self, box: Floats) -> Any:
        return self.database.execute(SCAN, box.tolist()).fetchnumpy()["id"]

    def any(self, box: Floats) -> bool:
        return self.database.execute(SCAN + " LIMIT 1", box.tolist()).fetchone() is not None

    def many(self, boxes: Floats) -> int:
        self.database.register("asked", _arrow(boxes, np.arange(len(boxes))))
        return len(self.database.execute(JOIN).fetchnumpy()["asked"])


def _arrow(boxes: Floats, ids: npt.NDArray[np.int64]) -> Any:
    import pyarrow as pa

    return pa.table({"id": ids} | {name: boxes[:, i] for i, name in enumerate(COLUMNS)})


class _Gist(Peer):
    """Boxes in PostgreSQL under a GiST index; statements are prepared, rows come in binary."""

    create: tuple[str, ...]
    row: str
    query: str
    join: str

    def __init__(self, boxes: Floats, server: str) -> None:
        import psycopg

        self.boxes = boxes
        self.connection = psycopg.connect(server, autocommit=True)
        for statement in self.create:
            self.connection.execute(statement.encode())
        with self.connection.cursor() as cursor, cursor.copy(b"COPY incoming FROM STDIN") as copy:
            for number, box in enumerate(boxes.tolist()):
                copy.write_row((number, *box))
        self.connection.execute(self.row.encode())
        self.connection.execute(b"CREATE INDEX ON boxes USING gist (" + self.key.encode() + b")")
        self.connection.execute(b"VACUUM ANALYZE boxes")
        self.cursor = self.connection.cursor(binary=True)

    key = "c"

    @property
    def nbytes(self) -> int:
        row = self.connection.execute(b"SELECT pg_total_relation_size('boxes')").fetchone()
        assert row is not None
        return int(row[0])

    def _rows(self, query: str, asked: list[Any]) -> list[Any]:
        return self.cursor.execute(query.encode(), asked, prepare=True).fetchall()

    def one(self, box: Floats) -> Any:
        return np.array([row[0] for row in self._rows(self.query, [box.tolist()])], np.int64)

    def any(self, box: Floats) -> bool:
        return bool(self._rows(self.query + " LIMIT 1", [box.tolist()]))

    def many(self, boxes: Floats) -> int:
        return len(self._rows(self.join, [boxes[:, i].tolist() for i in range(6)]))

    def close(self) -> None:
        self.connection.execute(b"DROP TABLE boxes")
        self.connection.close()


_INCOMING = "CREATE TEMP TABLE incoming (id INTEGER, x0 FLOAT8, y0 FLOAT8, z0 FLOAT8, x1 FLOAT8, y1 FLOAT8, z1 FLOAT8)"
_ASKED = "unnest(%s::float8[], %s::float8[], %s::float8[], %s::float8[], %s::float8[], %s::float8[]) WITH ORDINALITY"


class Cube(_Gist):
    name = "cube GiST"
    create = (
        "CREATE EXTENSION IF NOT EXISTS cube",
        "CREATE SCHEMA IF NOT EXISTS as_cubes",
        "SET search_path = as_cubes, public",
        _INCOMING,
    )
    row = "CREATE TABLE boxes AS SELECT id, cube(ARRAY[x0, y0, z0], ARRAY[x1, y1, z1]) AS c FROM incoming"
    query = "SELECT id FROM boxes, (SELECT %s::float8[] AS q OFFSET 0) AS asked WHERE c && cube(q[1:3], q[4:6])"
    join = (
        f"SELECT n, id FROM {_ASKED} AS a (x0, y0, z0, x1, y1, z1, n) "  # noqa: S608
        "JOIN boxes ON c && cube(ARRAY[x0, y0, z0], ARRAY[x1, y1, z1])"
    )


class PostGis(_Gist):
    name = "PostGIS n-d GiST"
    key = "c gist_geometry_ops_nd"
    create = (
        "CREATE EXTENSION IF NOT EXISTS postgis",
        "CREATE SCHEMA IF NOT EXISTS as_lines",
        "SET search_path = as_lines, public",
        _INCOMING,
    )
    row = (
        "CREATE TABLE boxes AS SELECT *, ST_MakeLine(ST_MakePoint(x0, y0, z0), ST_MakePoint(x1, y1, z1)) AS c "
        "FROM incoming"
    )
    query = (
        "SELECT id FROM boxes, (SELECT %s::float8[] AS q OFFSET 0) AS asked "
        "WHERE c &&& ST_MakeLine(ST_MakePoint(q[1], q[2], q[3]), ST_MakePoint(q[4], q[5], q[6])) "
        "AND x0 <= q[4] AND y0 <= q[5] AND z0 <= q[6] AND x1 >= q[1] AND y1 >= q[2] AND z1 >= q[3]"
    )
    join = (
        f"SELECT n, id FROM {_ASKED} AS a (u0, v0, w0, u1, v1, w1, n) "  # noqa: S608
        "JOIN boxes ON c &&& ST_MakeLine(ST_MakePoint(u0, v0, w0), ST_MakePoint(u1, v1, w1)) "
        "AND x0 <= u1 AND y0 <= v1 AND z0 <= w1 AND x1 >= u0 AND y1 >= v0 AND z1 >= w0"
    )


@contextmanager
def postgresql() -> Iterator[tuple[str, list[type[_Gist]]]]:
    """A private server of the system's PostgreSQL, and which of the two extensions it has; says what is missing."""
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda p: int(p.parent.name))
    if not programs:
        print("Left out: cube and PostGIS; install the packages postgresql, postgresql-contrib and postgis.")
        yield "", []
        return
    version = programs[-1].parent.name
    extensions = Path(f"/usr/share/postgresql/{version}/extension")
    found: list[type[_Gist]] = [
        peer for peer, name in ((Cube, "cube"), (PostGis, "postgis")) if (extensions / f"{name}.control").is_file()
    ]
    if Cube not in found:
        print("Left out: cube; install the package postgresql-contrib.")
    if PostGis not in found:
        print(f"Left out: PostGIS; install the package postgresql-{version}-postgis-3.")
    folder = Path(tempfile.mkdtemp(prefix="relmodel-pg-"))
    user = "postgres" if os.geteuid() == 0 else None  # the server refuses to run as root
    if user:
        shutil.chown(folder, user)

    def run(program: str, *words: str) -> None:
        command = [str(programs[-1] / program), "-D", str(folder / "data"), *words]
        subprocess.run(command, user=user, check=True, stdout=subprocess.DEVNULL, cwd=folder)

    run("initdb", "--auth=trust", "--no-sync", "--username=bench")
    options = f"-k {folder} -c listen_addresses= -c fsync=off -c shared_buffers=1GB -c maintenance_work_mem=512MB"
    run("pg_ctl", "-w", "-l", str(folder / "log"), "-o", f"{options} -c max_wal_size=8GB -c work_mem=256MB", "start")
    try:
        yield f"host={folder} user=bench dbname=postgres", found
    finally:
        run("pg_ctl", "-m", "immediate", "stop")
        shutil.rmtree(folder, ignore_errors=True)


class Embree:
    """Embree's tree over the faces of the boxes.

    Its Python package casts rays and gives the first face hit: that answers "does any box meet this segment?" for a
    segment that begins in no box, and nothing else of what is measured here.  Listing all boxes that meet a volume
    would need its point queries or collisions, which the package does not offer.
    """

    name = "embree"

    def __init__(self, boxes: Floats) -> None:
        from embreex.mesh_construction import TriangleMesh
        from embreex.rtcore_scene import EmbreeScene

        corner = np.array([[i, 1 + j, 2 + k] for i in (0, 3) for j in (0, 3) for k in (0, 3)])
        faces = np.array([[0, 1, 3], [0, 3, 2], [4, 6, 7], [4, 7, 5], [0, 4, 5], [0, 5, 1], [2, 3, 7], [2, 7, 6],
                          [0, 2, 6], [0, 6, 4], [1, 5, 7], [1, 7, 3]])  # fmt: skip
        self.scene = EmbreeScene()
        triangles = boxes[:, corner[faces]].reshape(-1, 3, 3).astype(np.float32)
        TriangleMesh(self.scene, triangles)
        self.segments(np.zeros((1, 3)), np.ones((1, 3)))  # builds the tree

    def segments(self, start: Floats, end: Floats) -> npt.NDArray[np.bool_]:
        """Whether each segment (k) meets a face."""
        way = end - start
        length = np.linalg.norm(way, axis=1)
        hit = self.scene.run(start.astype(np.float32), (way / length[:, None]).astype(np.float32), query="DISTANCE")
        return np.asarray(hit <= length)
