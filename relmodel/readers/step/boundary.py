"""Loops of the faces of a shape of the CAD kernel; runs in the child process of the reader."""

from __future__ import annotations

from typing import Any, NamedTuple

from OCP.BRep import BRep_Tool
from OCP.BRepTools import BRepTools, BRepTools_WireExplorer
from OCP.TopAbs import TopAbs_Orientation as Sense
from OCP.TopAbs import TopAbs_ShapeEnum as Type
from OCP.TopExp import TopExp
from OCP.TopoDS import TopoDS, TopoDS_Iterator

from relmodel.readers.step.contained import Findings


class Coedge(NamedTuple):
    """An edge of a face taken as forward, the arc it is, and whether it runs against it."""

    edge: Any
    arc_no: int
    reversed: bool


def is_reversed(shape: Any) -> bool:
    return bool(shape.Orientation() == Sense.TopAbs_REVERSED)


def forward(face: Any) -> Any:
    """The face taken as forward."""
    return TopoDS.Face(face.Oriented(Sense.TopAbs_FORWARD))


def loops_of(face: Any, edges: Any, findings: Findings, surface_no: int) -> list[list[Coedge]]:
    """Loops of a face taken as forward, the outer one first, their coedges head to tail.

    edges: the `edge_map`; edges that are not in it are left out.  Where the kernel fails the order of the file stands,
    and `findings` says so of the surface.
    """
    wires = [TopoDS.Wire(one) for one in _children(face) if one.ShapeType() == Type.TopAbs_WIRE]
    if len(wires) > 1:
        with findings.contained("which loop of a face is the outer one", "unread_boundary", surface_no):
            outer = BRepTools.OuterWire_s(face)
            wires.sort(key=lambda wire: not wire.IsSame(outer))
    loops = []
    for wire in wires:
        loop = _stored(wire, edges)
        if not _is_chain(loop):
            with findings.contained("the order of the edges of a face", "unread_boundary", surface_no):
                loop = _explored(wire, face, edges, loop)
        loops.append(loop)
    return loops


def pcurve_of(coedge: Coedge, face: Any) -> tuple[Any, float, float] | None:
    """The curve of a coedge in the parameters of its face, taken as forward, with its range; None: it has none."""
    curve = BRep_Tool.CurveOnSurface_s(coedge.edge, face, 0.0, 0.0)
    return None if curve is None else (curve, *BRep_Tool.Range_s(coedge.edge, face))


def _children(shape: Any) -> list[Any]:
    out = []
    walk = TopoDS_Iterator(shape)
    while walk.More():
        out.append(walk.Value())
        walk.Next()
    return out


def _stored(wire: Any, edges: Any) -> list[Coedge]:
    stored = [one for edge in _children(wire) if (one := _coedge(edge, edges)) is not None]
    if is_reversed(wire):
        stored.reverse()
    return stored


def _explored(wire: Any, face: Any, edges: Any, stored: list[Coedge]) -> list[Coedge]:
    explorer, found = BRepTools_WireExplorer(wire, face), []
    while explorer.More():
        one = _coedge(explorer.Current(), edges)
        if one is not None:
            found.append(one)
        explorer.Next()
    # The kernel leaves out what it cannot reach.
    return found if sorted(one[1:] for one in found) == sorted(one[1:] for one in stored) else stored


def _coedge(edge: Any, edges: Any) -> Coedge | None:
    arc_no = edges.FindIndex(edge) - 1
    return None if arc_no < 0 else Coedge(TopoDS.Edge(edge), arc_no, is_reversed(edge))


def _is_chain(coedges: list[Coedge]) -> bool:
    """Whether each coedge ends where the next begins."""
    if len(coedges) < 2:
        return True
    heads = [TopExp.LastVertex_s(one.edge, True) for one in coedges]
    tails = [TopExp.FirstVertex_s(one.edge, True) for one in coedges]
    return all(head.IsSame(tail) for head, tail in zip(heads, tails[1:] + tails[:1], strict=True))
