"""Extraction of STEP files beyond the kernel's own reading, beside a plain walk with the kernel, and memory.

    python benchmarks/step_extraction.py FILE...

Besides the files a part of 3,072 faces is composed.  Each stage runs in a process of its own, on one core, and is
timed by its CPU time: the kernel's reading; a plain walk that asks the kernel, face by face and edge by edge, for what
the extraction gives (surface, area, centroid, exact box; length, box, dihedral angle; points, tangents and normals
each millimetre along the edges; triangles with normals); the extraction, at best of three times, so that importing
modules is no part of it; and the writing of its rows to a new store.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import tempfile
import time
from pathlib import Path
from typing import Any

import numpy as np
from tabulate import tabulate

STAGES = ("walk", "extract", "write")
GOAL = 1500


def main() -> None:
    with tempfile.TemporaryDirectory() as folder:
        plate = Path(folder) / "plates.step"
        _stage("compose", plate)
        rows = []
        for file in [*map(Path, sys.argv[1:]), plate]:
            got = {stage: _stage(stage, file) for stage in STAGES}
            faces = got["extract"]["faces"]
            if not faces:
                print(f"{file.name} has no face of the kernel's", file=sys.stderr)
                continue
            walk, extract, meshing = got["walk"]["seconds"], got["extract"]["seconds"], got["extract"]["meshing"]
            rows.append(
                (
                    f"{file.parent.name}/{file.name}"[-34:],
                    faces,
                    got["extract"]["reading"],
                    walk,
                    extract,
                    extract - meshing,
                    got["write"]["seconds"],
                    faces / walk,
                    faces / extract,
                    faces / (extract - meshing),
                    walk / extract,
                    got["extract"]["memory"],
                    got["write"]["memory"],
                )
            )
    names = "file faces reading walk extraction without_mesh writing walk extraction without_mesh ratio child parent"
    units = ["", "", *["s"] * 5, *["faces/s"] * 3, "", "MB", "MB"]
    heads = [f"{name.replace('_', ' ')}\n{unit}" for name, unit in zip(names.split(), units, strict=True)]
    print(tabulate(rows, headers=heads, floatfmt=("", "", *[".2f"] * 5, *[".0f"] * 3, ".1f", ".0f", ".0f")))
    print(f"\ngoal: {GOAL} faces/s beyond reading; memory under 500 MB for 3,000 faces")


def _stage(stage: str, file: Path) -> dict[str, float]:
    env = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONPATH": str(Path(__file__).parents[1])}
    done = subprocess.run(
        [sys.executable, __file__, "--stage", stage, str(file)], env=env, check=True, stdout=subprocess.PIPE
    )
    result: dict[str, float] = json.loads(done.stdout.splitlines()[-1])
    return result


def compose(path: Path) -> dict[str, float]:
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
    print()  # after what the kernel says
    return {}


def walk(file: Path) -> dict[str, float]:
    """What the extraction gives, asked of the kernel one by one."""
    from OCP.Bnd import Bnd_Box
    from OCP.BRep import BRep_Tool
    from OCP.BRepAdaptor import BRepAdaptor_Curve, BRepAdaptor_Surface
    from OCP.BRepBndLib import BRepBndLib
    from OCP.BRepGProp import BRepGProp
    from OCP.BRepLProp import BRepLProp_SLProps
    from OCP.BRepMesh import BRepMesh_IncrementalMesh
    from OCP.GCPnts import GCPnts_AbscissaPoint, GCPnts_UniformAbscissa
    from OCP.gp import gp_Pnt, gp_Vec
    from OCP.GProp import GProp_GProps
    from OCP.TopLoc import TopLoc_Location
    from OCP.TopoDS import TopoDS

    from relmodel.readers.step import maps

    shapes = _shapes(file)
    began = time.process_time()
    rows = 0
    for shape in shapes:
        keys = maps.face_map(shape)
        edge_keys = maps.edge_map(keys)
        faces = [TopoDS.Face(keys.FindKey(i)) for i in range(1, keys.Extent() + 1)]
        around: dict[int, list[Any]] = {}
        props, volume = GProp_GProps(), GProp_GProps()
        for face in faces:
            surface, box = BRepAdaptor_Surface(face), Bnd_Box()
            BRepGProp.SurfaceProperties_s(face, props)
            BRepBndLib.AddOptimal_s(face, box, False, False)
            own = maps.edge_map(maps.face_map(face))
            for i in range(1, own.Extent() + 1):
                around.setdefault(edge_keys.FindIndex(own.FindKey(i)), []).append((face, surface))
            rows += 1
        BRepGProp.VolumeProperties_s(shape, volume)
        point, tangent = gp_Pnt(), gp_Vec()
        for i in range(1, edge_keys.Extent() + 1):
            edge = TopoDS.Edge(edge_keys.FindKey(i))
            if BRep_Tool.Degenerated_s(edge):
                continue
            curve, box = BRepAdaptor_Curve(edge), Bnd_Box()
            length = GCPnts_AbscissaPoint.Length_s(curve)
            BRepBndLib.AddOptimal_s(edge, box, False, False)
            spaced = GCPnts_UniformAbscissa(curve, min(max(int(np.ceil(length)) + 1, 2), 2000))
            sides = [(surface, BRep_Tool.CurveOnSurface_s(edge, face, 0.0, 0.0)) for face, surface in around[i][:2]]
            for k in range(1, spaced.NbPoints() + 1):
                t = spaced.Parameter(k)
                curve.D1(t, point, tangent)
                normals = []
                for surface, drawn in sides:
                    look = BRepLProp_SLProps(surface, *drawn.Value(t).Coord(), 1, 1e-9)
                    if look.IsNormalDefined():
                        normals.append(look.Normal())
            if len(normals) == 2:
                normals[0].Angle(normals[1])
        BRepMesh_IncrementalMesh(shape, 0.05, False, 0.15, False)
        for face in faces:
            mesh, surface = BRep_Tool.Triangulation_s(face, TopLoc_Location()), BRepAdaptor_Surface(face)
            if mesh is None or not mesh.HasUVNodes():
                continue  # a file's own triangles have none
            for k in range(1, mesh.NbNodes() + 1):
                mesh.Node(k).Coord()
                BRepLProp_SLProps(surface, *mesh.UVNode(k).Coord(), 1, 1e-9)
            for k in range(1, mesh.NbTriangles() + 1):
                mesh.Triangle(k).Get()
    return {"seconds": time.process_time() - began, "faces": rows}


def _shapes(file: Path) -> list[Any]:
    """The distinct shapes of a file, by the kernel's reader of products."""
    from OCP.collections import Sequence_TDF_Label
    from OCP.STEPCAFControl import STEPCAFControl_Reader
    from OCP.TCollection import TCollection_ExtendedString
    from OCP.TDocStd import TDocStd_Document
    from OCP.XCAFDoc import XCAFDoc_DocumentTool, XCAFDoc_ShapeTool

    document = TDocStd_Document(TCollection_ExtendedString("walk"))
    reader = STEPCAFControl_Reader()
    reader.ReadFile(str(file))
    reader.Transfer(document)
    labels = Sequence_TDF_Label()
    XCAFDoc_DocumentTool.ShapeTool_s(document.Main()).GetShapes(labels)
    return [XCAFDoc_ShapeTool.GetShape_s(label) for label in labels if XCAFDoc_ShapeTool.IsSimpleShape_s(label)]


def extract(file: Path) -> dict[str, float]:
    """The extraction as the child process does it, less the kernel's reading."""
    from relmodel.readers.step import shape as step_shape
    from relmodel.readers.step import triangulation as step_mesh
    from relmodel.readers.step.read import read_step

    spent: dict[str, float] = {}

    def timed(function: Any, name: str) -> Any:
        def run(*given: Any) -> Any:
            began = time.process_time()
            out = function(*given)
            spent[name] += time.process_time() - began
            return out

        return run

    step_shape.extract_all = timed(step_shape.extract_all, "seconds")
    step_mesh.meshes = timed(step_mesh.meshes, "meshing")
    laps = []
    for _ in range(3):
        spent.update(seconds=0.0, meshing=0.0)
        began = time.process_time()
        faces = read_step(file).faces_loaded
        reading = time.process_time() - began - spent["seconds"]
        laps.append({**spent, "reading": reading, "faces": faces, "memory": _memory_mb()})
    return min(laps, key=lambda lap: lap["seconds"]) | {"memory": laps[0]["memory"]}


def _memory_mb() -> float:
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def write(file: Path) -> dict[str, float]:
    """The rows of a file written to a new store, in the parent process."""
    from relmodel.loading.load import load
    from relmodel.store import Store

    with tempfile.TemporaryDirectory() as folder, Store.create(Path(folder) / "store.duckdb") as store:
        began = time.process_time()
        load(store, file, name="part")
        return {"seconds": time.process_time() - began}


if __name__ == "__main__":
    if sys.argv[1:2] == ["--stage"]:
        import gc

        if sys.argv[2] != "write":
            gc.disable()  # as in the child
        result = {"compose": compose, "walk": walk, "extract": extract, "write": write}[sys.argv[2]](Path(sys.argv[3]))
        print(json.dumps({"memory": _memory_mb()} | result))
    else:
        main()
