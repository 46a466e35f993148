"""What `relmodel load` costs a user, beside the CAD kernel's own reading, walking and meshing in a plain process.

    python benchmarks/loading.py FILE...

Besides the files an assembly of 3,072 faces is composed.  Seconds are those of the processor, of a process and its
children, starting included; memory is the greatest of any of them.  A second table says where the seconds of the
parent process go: modules that are imported, and functions of relmodel with what they call, by cProfile, which makes
them somewhat longer; and the third where those of the child go that runs the kernel.
"""

from __future__ import annotations

import cProfile
import gzip
import json
import os
import pstats
import resource
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from tabulate import tabulate

PARENT = (
    ("writing the model", "write/write.py", "write"),
    ("features", "features/__init__.py", "recognise"),
    ("circles and their relations", "circles.py", "append_circles"),
    ("content keys", "content_keys.py", "shape_keys"),
    ("tables to the engine", "store/bulk.py", "append"),
    ("imports", "<frozen importlib._bootstrap>", "_find_and_load"),
)
CHILD = (
    ("reading", "STEPCAFControl", "ReadStream"),
    ("transfer", "STEPCAFControl", "Transfer"),
    ("labels", "document.py", "root"),
    ("triangles", "triangulation.py", "_triangulate"),
    ("triangles read and measured", "triangulation.py", "mesh"),
    ("areas and volumes", "face_measures.py", "integrals"),
    ("boxes of curved faces", "face_measures.py", "widen_boxes"),
    ("loops", "shape.py", "_loops"),
    ("adjacency and samples", "measures.py", "samples"),
    ("all of the extraction", "shape.py", "extract_all"),
    ("text", "properties.py", "attach"),
)


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        plate = Path(folder) / "plates.step"
        _run([sys.executable, __file__, "--stage", "compose", str(plate)])
        rows: list[tuple[Any, ...]] = []
        parents: list[tuple[Any, ...]] = []
        children: list[tuple[Any, ...]] = []
        for file in [*map(Path, sys.argv[1:]), plate]:
            name = f"{file.parent.name}/{file.name}"[-34:]
            kernel, kernel_memory, faces = _run([sys.executable, __file__, "--stage", "kernel", str(file)])
            store = Path(folder) / f"{len(rows)}.duckdb"
            relmodel = [sys.executable, "-m", "relmodel"]
            _run([*relmodel, "init", "--store", str(store)])
            load, memory, _ = _run([*relmodel, "load", str(file), "--store", str(store), "--object", "part"])
            rows.append((name, faces, kernel, load, load / kernel, kernel_memory, memory))
            for stage, into in (("parent", parents), ("child", children)):
                into.append((name, *_run([sys.executable, __file__, "--stage", stage, str(file)])[2]))
    units = ["", "", "s", "s", "", "MB", "MB"]
    names = ["file", "faces", "kernel", "relmodel load", "ratio", "kernel", "relmodel load"]
    heads = [f"{name}\n{unit}" for name, unit in zip(names, units, strict=True)]
    print(tabulate(rows, headers=heads, floatfmt=("", "", ".2f", ".2f", ".1f", ".0f", ".0f")))
    for title, table, places in (("parent", parents, PARENT), ("child", children, CHILD)):
        print(f"\nseconds of the {title}")
        print(tabulate(table, headers=["file", *(name for name, *_ in places), "all"], floatfmt=".2f"))


def _run(command: list[str]) -> tuple[float, float, Any]:
    """Processor seconds and greatest memory (MB) of a command and its children, and what its last line says."""
    env = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[1])}
    watched = [sys.executable, __file__, "--stage", "watch", *command]
    done = subprocess.run(watched, env=env, check=True, stdout=subprocess.PIPE)
    seconds, memory, said = json.loads(done.stdout.splitlines()[-1])
    return seconds, memory, said


def watch(command: list[str]) -> Any:
    """A process of its own, for the greatest memory of children is over all that there ever were."""
    done = subprocess.run(command, check=True, stdout=subprocess.PIPE)
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    last = done.stdout.splitlines()[-1:] or [b""]
    try:
        said = json.loads(last[0])
    except ValueError:
        said = None
    return used.ru_utime + used.ru_stime, used.ru_maxrss / 1024, said


def compose(path: Path) -> None:
    """Twelve plates as one part, each with 25 pockets through it, of rounded corners, and 50 holes: 3,072 faces."""
    from OCP.BRep import BRep_Builder
    from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeEdge, BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakeWire
    from OCP.BRepPrimAPI import BRepPrimAPI_MakePrism
    from OCP.gp import gp_Ax2, gp_Circ, gp_Dir, gp_Pln, gp_Pnt, gp_Trsf, gp_Vec
    from OCP.STEPControl import STEPControl_StepModelType, STEPControl_Writer
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS, TopoDS_Compound

    down = gp_Dir(0, 0, -1)

    def pocket(x: float, y: float, a: float, b: float, r: float) -> Any:
        """Clockwise from the upper side, as a hole's wire runs."""
        wire = BRepBuilderAPI_MakeWire()
        corners = [(x + r, y + b - r), (x + a - r, y + b - r), (x + a - r, y + r), (x + r, y + r)]
        for (cx, cy), turn in zip(corners, (0.5, 0.0, -0.5, -1.0), strict=True):
            start, end = ((cx + r * np.cos(t), cy + r * np.sin(t)) for t in (np.pi * (turn + 0.5), np.pi * turn))
            circle = gp_Circ(gp_Ax2(gp_Pnt(cx, cy, 0), down), r)
            wire.Add(BRepBuilderAPI_MakeEdge(circle, gp_Pnt(*start, 0), gp_Pnt(*end, 0)).Edge())
            last, (first_x, first_y) = end, corners[(corners.index((cx, cy)) + 1) % 4]
            t = np.pi * turn
            following = (first_x + r * np.cos(t), first_y + r * np.sin(t))
            wire.Add(BRepBuilderAPI_MakeEdge(gp_Pnt(*last, 0), gp_Pnt(*following, 0)).Edge())
        return wire.Wire()

    part = TopoDS_Compound()
    builder = BRep_Builder()
    builder.MakeCompound(part)
    for number in range(12):
        ground = gp_Pln(gp_Pnt(0, 0, 20.0 * number), gp_Dir(0, 0, 1))
        face = BRepBuilderAPI_MakeFace(ground, 0.0, 300.0, 0.0, 300.0)
        up = gp_Vec(0, 0, 20.0 * number)
        for i in range(5):
            for j in range(5):
                x, y = 60.0 * i, 60.0 * j
                wires = [pocket(x + 5, y + 5, 40.0 + 0.1 * number, 36.0 + 0.1 * j, 4.0)]
                for at in (12.0, 40.0):
                    circle = gp_Circ(gp_Ax2(gp_Pnt(x + at, y + 52, 0), down), 2.0 + 0.05 * i)
                    wires.append(BRepBuilderAPI_MakeWire(BRepBuilderAPI_MakeEdge(circle).Edge()).Wire())
                lift = gp_Trsf()
                lift.SetTranslation(up)
                for wire in wires:
                    face.Add(TopoDS.Wire(wire.Moved(TopLoc_Location(lift))))
        builder.Add(part, BRepPrimAPI_MakePrism(face.Face(), gp_Vec(0, 0, 12)).Shape())
    writer = STEPControl_Writer()
    writer.Transfer(part, STEPControl_StepModelType.STEPControl_AsIs)
    writer.Write(str(path))


def kernel(file: Path) -> int:
    """The kernel's own reading of a file, a walk over its faces and edges, and its mesh; how many faces there are."""
    from OCP.BRep import BRep_Tool
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.collections import Sequence_TDF_Label
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.TopAbs import TopAbs_ShapeEnum
    from OCP.TopExp import TopExp_Explorer
    from OCP.TopoDS import TopoDS
    from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

    document = TDocStd_Document(TCollection_ExtendedString("plain"))
    reader = STEPCAFControl_Reader()
    with tempfile.NamedTemporaryFile(suffix=".step") as plain:
        plain.write(gzip.decompress(file.read_bytes()) if file.suffix == ".gz" else file.read_bytes())
        plain.flush()
        reader.ReadFile(plain.name)
    reader.Transfer(document)
    labels = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetShapes(labels)
    count = 0
    for label in labels:
        if not XCAFDoc_ShapeTool.IsSimpleShape_s(label):
            continue
        shape = XCAFDoc_ShapeTool.GetShape_s(label)
        faces = TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
        while faces.More():
            BRep_Tool.Surface_s(TopoDS.Face(faces.Current()))
            edges = TopExp_Explorer(faces.Current(), TopAbs_ShapeEnum.TopAbs_EDGE)
            while edges.More():
                BRep_Tool.Curve_s(TopoDS.Edge(edges.Current()), 0.0, 0.0)
                edges.Next()
            count += 1
            faces.Next()
        BRepMesh_IncrementalMesh(shape, 0.05, False, 0.15, False)
    return count


def parent(file: Path) -> list[float]:
    """Where the seconds of the process go that loads a file."""

    def load_it() -> None:
        from relmodel.loading.load import load
        from relmodel.store import Store

        with tempfile.TemporaryDirectory() as folder, Store.create(Path(folder) / "store.duckdb") as store:
            load(store, file, name="part")

    return _profiled(load_it, PARENT)


def child(file: Path) -> list[float]:
    """Where the seconds of the process go that runs the kernel, its imports left out."""
    from relmodel.readers import read

    return _profiled(lambda: read(file, in_child=False), CHILD)


def _profiled(job: Callable[[], Any], places: tuple[tuple[str, str, str], ...]) -> list[float]:
    """Processor seconds of functions with what they call, and of all."""
    profile = cProfile.Profile(time.process_time)
    began = time.process_time()
    profile.runcall(job)
    spent = time.process_time() - began
    found = pstats.Stats(profile).stats  # type: ignore[attr-defined]
    out = []
    for _, where, name in places:
        own = [v[3] for (path, _, function), v in found.items() if where in f"{path} {function}" and name in function]
        out.append(max(own, default=0.0))
    return [*out, spent]


STAGES: dict[str, Callable[[Path], Any]] = {"compose": compose, "kernel": kernel, "parent": parent, "child": child}


if __name__ == "__main__":
    if sys.argv[1:3] == ["--stage", "watch"]:
        print(json.dumps(watch(sys.argv[3:])))
    elif sys.argv[1:2] == ["--stage"]:
        answer = STAGES[sys.argv[2]](Path(sys.argv[3]))
        print("\n" + json.dumps(answer))
    else:
        main()
