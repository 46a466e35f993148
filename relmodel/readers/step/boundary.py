"""The boundary of a shape from the CAD kernel's binary form: faces, wires, edges, curves and pcurves.

To ask the kernel for them one by one takes ten times as long as to have it write them all (`BinTools`, version 4: the
sets of locations, of curves in two and in three dimensions and of surfaces, then the shapes, pieces before what they
are pieces of).  Runs in the child process of `kernel.py` alone.
"""

from __future__ import annotations

from io import BytesIO
from struct import Struct
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt
from OCP.BinTools import BinTools, BinTools_FormatVersion

Array = npt.NDArray[np.float64]
# Locations multiplied from left to right: elementary ones by number, and their powers; () is the identity.
Location = tuple[tuple[int, int], ...]

_VERSION = BinTools_FormatVersion.BinTools_FormatVersion_VERSION_4
_FACE, _WIRE, _EDGE, _VERTEX = 4, 5, 6, 7
_REVERSED = 1  # of the orientations forward, reversed, internal and external
_FLAGS = 7  # bytes after what a shape holds
_END = ord("*")  # of the pieces of a shape

NO_TURN = 1e-6  # rad, of a degenerate edge: kernels put such where round-off leaves a gap between two edges

_PIECE = Struct("<Bii")  # orientation, shape, location
_IN_SPACE = Struct("<iidd")  # curve, location, range
_ON_SURFACE = Struct("<iiidd")  # pcurve, surface, location, range
_ON_SEAM = Struct("<iiBiidd")  # pcurve, the one of the reversed edge, continuity, surface, location, range
_REGULARITY_SIZE = 17
_FACE_HEAD = Struct("<?diiB")  # natural restriction, tolerance, surface, location, whether triangles follow
_POINT_SIZES = (0, 17, 21, 25)  # bytes of a vertex's representation, by its kind
_KINDS = ("", "line", "circle", "ellipse", "parabola", "hyperbola", "bezier", "spline", "trimmed", "offset")
_RADII = {"circle": 1, "ellipse": 2, "parabola": 1, "hyperbola": 2}


class Spline(NamedTuple):
    """A b-spline; poles (n, d), weights None where it is not rational."""

    degree: int
    periodic: bool
    knots: Array
    multiplicities: npt.NDArray[np.int32]
    poles: Array
    weights: Array | None


class Curve(NamedTuple):
    """A curve; numbers: place, directions (in space z x y, on a surface x y, of a line its own) and radii."""

    kind: str
    numbers: tuple[float, ...]
    spline: Spline | None


class Edge(NamedTuple):
    """curve: of which to take the part t0 to t1, None where there is none; place: of its first vertex."""

    curve: Curve | None
    t0: float
    t1: float
    degenerate: bool
    place: tuple[float, float, float]
    location: Location


class Coedge(NamedTuple):
    """An edge in a wire of a face taken as forward; tail, head: the vertices it runs from and to."""

    edge: int
    reversed: bool
    tail: Any
    head: Any
    seat: tuple[int, int, Location]  # its shape, the surface, and the surface's location as the edge sees it


class Wire(NamedTuple):
    """A wire of a face taken as forward: whether it is reversed, and its coedges as they are stored."""

    reversed: bool
    coedges: list[Coedge]


class Boundary:
    """What a shape is bounded by.

    faces: of each face that has edges, in the kernel's order, its wires as they are stored.
    edges: in the order in which they occur there, without those of no turn about a pole or apex.
    """

    def __init__(self, shape: Any) -> None:
        stream = BytesIO()
        BinTools.Write_s(shape, stream, False, False, _VERSION)
        self._data, self._at = stream.getvalue(), 0
        self._matrices: dict[int, Array] = {}
        self._locations: list[Location] = [()]
        for number in range(1, self._head(b"\nLocations ") + 1):
            self._locations.append(self._location(number))
        self._pcurves = self._set_of_curves(2, self._head(b"Curve2ds "))
        self._curves = self._set_of_curves(3, self._head(b"Curves "))
        self._at = self._data.index(b"Triangulations ", self._data.index(b"Surfaces ", self._at))
        count = self._head(b"\nTShapes ")
        self._shapes = [self._shape(count) for _ in range(count)]
        self._known: dict[tuple[int, Location], tuple[int, Any, Any]] = {}  # edges: number and vertices
        self.edges: list[Edge] = []
        self.faces = self._faces()

    def pcurve(self, coedge: Coedge) -> tuple[Curve, float, float] | None:
        """The pcurve of a coedge with its range, if it has one."""
        number, surface, location = coedge.seat
        for one in self._shapes[number][1][1]:
            if len(one) > 4 and one[-4] == surface and self._locations[one[-3]] == location:
                own = one[1] if len(one) == 7 and coedge.reversed else one[0]
                return self._pcurves[own - 1], one[-2], one[-1]
        return None

    def matrix(self, location: Location) -> Array:
        """A location as 4x4."""
        out = np.eye(4)
        for number, power in location:
            out = out @ np.linalg.matrix_power(self._matrices[number], power)
        return out

    def _head(self, name: bytes) -> int:
        """Go to the set of a name and return how many it holds."""
        start = self._data.index(name, self._at) + len(name)
        end = self._data.index(b"\n", start)
        self._at = end + 1
        return int(self._data[start:end])

    def _doubles(self, count: int) -> Array:
        self._at += 8 * count
        return np.frombuffer(self._data, "<f8", count, self._at - 8 * count)

    def _location(self, number: int) -> Location:
        at = self._at
        if self._data[at] == 1:
            self._at += 1
            self._matrices[number] = np.vstack([self._doubles(12).reshape(3, 4), [0.0, 0.0, 0.0, 1.0]])
            return ((number, 1),)
        out: Location = ()
        at += 1
        while one := int.from_bytes(self._data[at : at + 4], "little"):
            power = int.from_bytes(self._data[at + 4 : at + 8], "little", signed=True)
            for _ in range(abs(power)):
                out = _joined(self._locations[one] if power > 0 else _inverse(self._locations[one]), out)
            at += 8
        self._at = at + 4
        return out

    def _set_of_curves(self, dimension: int, count: int) -> list[Curve]:
        data, out = self._data, []
        plain = [_LAYOUTS[dimension].get(kind) for kind in _KINDS]
        for _ in range(count):
            number = data[self._at]
            layout = plain[number]
            if layout is None:
                out.append(self._curve(dimension))
            else:
                out.append(Curve(_KINDS[number], layout.unpack_from(data, self._at + 1), None))
                self._at += 1 + layout.size
        return out

    def _curve(self, dimension: int) -> Curve:
        data, at = self._data, self._at
        kind = _KINDS[data[at]]
        if kind == "spline":
            return self._spline(dimension)
        if kind == "trimmed":
            self._at = at + 1 + 16
            return self._curve(dimension)
        if kind == "offset":
            self._at = at + 1 + 8 + (24 if dimension == 3 else 0)
            self._curve(dimension)
            return Curve(kind, (), None)
        if kind == "bezier":
            rational, degree = data[at + 1], int.from_bytes(data[at + 2 : at + 4], "little")
            self._at = at + 4
            poles, weights = self._poles(degree + 1, dimension, bool(rational))
            ends = np.array([0.0, 1.0]), np.array([degree + 1] * 2, np.int32)
            return Curve("spline", (), Spline(degree, False, *ends, poles, weights))
        layout = _LAYOUTS[dimension][kind]
        self._at = at + 1 + layout.size
        return Curve(kind, layout.unpack_from(data, at + 1), None)

    def _spline(self, dimension: int) -> Curve:
        rational, periodic, degree, poles_count, knots_count = _SPLINE_HEAD.unpack_from(self._data, self._at + 1)
        self._at += 1 + _SPLINE_HEAD.size
        poles, weights = self._poles(poles_count, dimension, rational)
        knots = np.frombuffer(self._data, _KNOT, knots_count, self._at)
        self._at += knots.nbytes
        return Curve("spline", (), Spline(degree, periodic, knots["knot"], knots["multiplicity"], poles, weights))

    def _poles(self, count: int, dimension: int, rational: bool) -> tuple[Array, Array | None]:
        numbers = self._doubles(count * (dimension + rational)).reshape(count, -1)
        return numbers[:, :dimension], numbers[:, dimension] if rational else None

    def _shape(self, count: int) -> tuple[int, Any, list[tuple[int, int, Location]]]:
        """Kind of one of the shapes, what it holds, and its pieces: orientation, shape, location."""
        data, at, locations, unpack = self._data, self._at, self._locations, _PIECE.unpack_from
        kind = data[at]
        at += 1
        own: Any = None
        if kind == _VERTEX:
            own = at + 8  # after the tolerance
            at += 32
            while data[at]:
                at += _POINT_SIZES[data[at]]
            at += 1
        elif kind == _EDGE:
            own = bool(data[at + 10]), []  # after the tolerance, and whether parameters and ranges agree
            at += 11
            while one := data[at]:
                at += 1
                if one == 4:
                    at += _REGULARITY_SIZE
                    continue
                layout = (_IN_SPACE, _ON_SURFACE, _ON_SEAM)[one - 1]
                own[1].append(layout.unpack_from(data, at))
                at += layout.size
            at += 1
        elif kind == _FACE:
            _, _, surface, location, triangles = _FACE_HEAD.unpack_from(data, at)
            own = surface, self._locations[location]
            at += _FACE_HEAD.size + (4 if triangles == 2 else 0)
        at += _FLAGS
        pieces = []
        while data[at] != _END:
            orientation, number, location = unpack(data, at)
            pieces.append((orientation, count - number, locations[location]))  # counted from the last one
            at += _PIECE.size
        self._at = at + 1
        return kind, own, pieces

    def _faces(self) -> list[list[Wire]]:
        seen, out = set(), []
        _, number, place = _PIECE.unpack_from(self._data, self._at)
        stack = [(len(self._shapes) - number, self._locations[place])]
        while stack:
            number, location = stack.pop()
            kind, own, pieces = self._shapes[number]
            if kind < _FACE:
                stack += [(one, _joined(location, at)) for _, one, at in reversed(pieces)]
            elif kind == _FACE and (number, location) not in seen:
                seen.add((number, location))
                seat = own[0], _joined(location, own[1])
                wires = [
                    self._wire(turn, one, _joined(location, at), *seat)
                    for turn, one, at in pieces
                    if self._shapes[one][0] == _WIRE
                ]
                if any(wire.coedges for wire in wires):
                    out.append(wires)
        return out

    def _wire(self, turn: int, number: int, location: Location, surface: int, place: Location) -> Wire:
        out = []
        for own, edge, inner in self._shapes[number][2]:
            if self._is_no_turn(edge):
                continue
            at = _joined(location, inner) if location else inner
            known = self._known.get((edge, at))
            if known is None:
                known = self._known[edge, at] = len(self.edges), *self._ends(edge, at)
                self.edges.append(self._edge(edge, at))
            ordinal, first, last = known
            orientation = own if own > _REVERSED else turn if turn > _REVERSED else own ^ turn
            seat = edge, surface, _joined(_inverse(at), place) if at else place
            if orientation == _REVERSED:
                out.append(Coedge(ordinal, True, last, first, seat))
            else:
                out.append(Coedge(ordinal, False, first, last, seat))
        return Wire(turn == _REVERSED, out)

    def _is_no_turn(self, edge: int) -> bool:
        degenerate, drawn = self._shapes[edge][1]
        return bool(degenerate and drawn and drawn[0][-1] - drawn[0][-2] < NO_TURN)

    def _ends(self, edge: int, location: Location) -> tuple[Any, Any]:
        """The vertices, with their locations, that an edge, taken as forward, runs from and to."""
        first = last = None
        for orientation, vertex, at in self._shapes[edge][2]:
            if orientation == _REVERSED:
                last = last or (vertex, _joined(location, at))
            elif orientation < _REVERSED:
                first = first or (vertex, _joined(location, at))
        return first, last

    def _edge(self, number: int, location: Location) -> Edge:
        degenerate, drawn = self._shapes[number][1]
        place = (0.0, 0.0, 0.0)
        if degenerate:
            vertex, at = self._ends(number, location)[0]
            here = np.frombuffer(self._data, "<f8", 3, self._shapes[vertex][1])
            x, y, z = (self.matrix(at) @ [*here, 1.0])[:3].tolist() if at else here.tolist()
            place = x, y, z
        t0, t1 = drawn[0][-2:] if drawn else (0.0, 0.0)
        for one in drawn:
            if len(one) == 4:
                return Edge(
                    self._curves[one[0] - 1], t0, t1, degenerate, place, _joined(location, self._locations[one[1]])
                )
        return Edge(None, t0, t1, degenerate, place, location)


_SPLINE_HEAD = Struct("<??Hii")
_KNOT = np.dtype([("knot", "<f8"), ("multiplicity", "<i4")])
_LAYOUTS = {
    d: {
        "line": Struct(f"<{2 * d}d"),
        **{kind: Struct(f"<{d * (4 if d == 3 else 3) + radii}d") for kind, radii in _RADII.items()},
    }
    for d in (2, 3)
}


def _joined(a: Location, b: Location) -> Location:
    if not a or not b:
        return a or b
    (left, power), (right, other) = a[-1], b[0]
    if left != right:
        return a + b
    middle = ((left, power + other),) if power + other else ()
    return _joined(a[:-1] + middle, b[1:]) if middle else _joined(a[:-1], b[1:])


def _inverse(location: Location) -> Location:
    return tuple((number, -power) for number, power in reversed(location))
