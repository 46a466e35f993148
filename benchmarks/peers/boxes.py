"""What else finds the boxes that meet a box, each behind the same few calls; answers are equal, to the last bit.

`one` gives the numbers of the boxes that meet a box, `any` whether there is one, `many` how many pairs some boxes
make, all pairs fetched, `view` the boxes that meet a view.  Peers with bounds in 32 bits look at exact ones then."""

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

import numpy as np
import numpy.typing as npt
import shapely

from relmodel.find.boxes import page_order
from relmodel.find.indexes import BoxIndex, build
from relmodel.find.volumes import Frustum, VolumeTable, boxes_met

Floats = npt.NDArray[np.float64]
COLUMNS = ("x0", "y0", "z0", "x1", "y1", "z1")

SQLITE = "SELECT id FROM boxes WHERE x0 <= ? AND x1 >= ? AND y0 <= ? AND y1 >= ? AND z0 <= ? AND z1 >= ?"
SQLITE_JOIN = (
    "SELECT q.rowid, b.id FROM asked AS q JOIN boxes AS b ON b.x0 <= q.x1 AND b.x1 >= q.x0 AND b.y0 <= q.y1 AND "
    "b.y1 >= q.y0 AND b.z0 <= q.z1 AND b.z1 >= q.z0"
)


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

    def view(self, view: Frustum) -> Any:
        return within(view, self.boxes, np.asarray(self.one(view.bounds)))

    def many(self, boxes: Floats) -> int:
        return sum(len(self.one(box)) for box in boxes)


class Kind(Peer):
    """One of this project's, in process."""

    def __init__(self, boxes: Floats, kind: str) -> None:
        self.name = kind
        self.index: BoxIndex = build(kind, boxes)

    def one(self, box: Floats) -> Any:
        return self.index.in_box(box)

    def many(self, boxes: Floats) -> int:
        return len(self.index.in_boxes(boxes)[0])

    def view(self, view: Frustum) -> Any:
        return self.index.in_volumes(VolumeTable.of([view]))[1]


class LeanSqlite(Peer):
    """Of bounds in 32 bits alone: what is found is held against the exact ones outside."""

    name = "lean R*Tree"

    def __init__(self, boxes: Floats) -> None:
        self.boxes = boxes
        self.database = sqlite3.connect(":memory:")
        self.database.execute("CREATE VIRTUAL TABLE boxes USING rtree(id, x0, x1, y0, y1, z0, z1)")
        rows = zip(range(len(boxes)), *boxes[:, [0, 3, 1, 4, 2, 5]].T.tolist(), strict=True)
        self.database.executemany("INSERT INTO boxes VALUES (?,?,?,?,?,?,?)", rows)

    def one(self, box: Floats) -> Any:
        rows = self.database.execute(SQLITE, box[[3, 0, 4, 1, 5, 2]].tolist()).fetchall()
        found = np.array([row[0] for row in rows], np.int64)
        return found[_meet(self.boxes[found], box)]

    def many(self, boxes: Floats) -> int:
        self.database.execute("DROP TABLE IF EXISTS asked")
        self.database.execute("CREATE TEMP TABLE asked (x0, y0, z0, x1, y1, z1)")
        self.database.executemany("INSERT INTO asked VALUES (?,?,?,?,?,?)", boxes.tolist())  # its rows count from 1
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
    """VTK's static cell locator over the boxes' diagonals; of the cells of all bins that a box meets bounds decide."""

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


class NumpyScan(Peer):
    """All boxes looked at, column by column, in as few passes as they allow."""

    name = "NumPy scan"

    def __init__(self, boxes: Floats) -> None:
        self.boxes = boxes
        self.number = page_order(boxes)
        self.columns = np.ascontiguousarray(boxes[self.number].T)

    def one(self, box: Floats) -> Any:
        x0, y0, z0, x1, y1, z1 = self.columns
        met = (x0 <= box[3]) & (x1 >= box[0])
        for low, high, axis in ((y0, y1, 1), (z0, z1, 2)):
            met &= low <= box[3 + axis]
            met &= high >= box[axis]
        return self.number[met]


@contextmanager
def postgresql() -> Iterator[str]:
    """A private server of the system's PostgreSQL with the extension cube; empty, with a word, where there is none."""
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"), key=lambda p: int(p.parent.name))
    if not programs or not Path(f"/usr/share/postgresql/{programs[-1].parent.name}/extension/cube.control").is_file():
        print("Left out: PostgreSQL; install the packages postgresql and postgresql-contrib.")
        yield ""
        return
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
        yield f"host={folder} user=bench dbname=postgres"
    finally:
        run("pg_ctl", "-m", "immediate", "stop")
        shutil.rmtree(folder, ignore_errors=True)
