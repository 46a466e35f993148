"""What every reader returns, whatever the file was: parts, shapes and assemblies as columns, not yet in a store.

All of it is frozen, and nothing writes into its tables and arrays: what follows from a model is a new value.

Columns bear the names of the schema's tables (`schema/030_surface.sql`, `040_part.sql`); ordinals (`surface_no`,
`arc_no`) stand where the tables hold identities. Lengths are mm, angles rad, all in the frame of the shape."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from typing import Any, Literal

from relmodel.arrays import Floats, Floats32, Ints, Ints32, Ragged, by_column
from relmodel.geometry.transforms import Joint

Table = dict[str, Any]  # column name -> array, Ragged or list; all of one length
Attribute = tuple[str, float | str | bool, str | None]  # name, value, unit of a number


@dataclass(frozen=True)
class Finding:
    """An irregularity that does not prevent loading: a row of `load_finding`.

    kind: a short name such as `open_edge`.  value, bound: what was measured and what it was compared with, in `unit`
    (None where it is no measure).  surface_no, arc_no: which face or edge of the shape, None where it is the whole."""

    kind: str
    message: str
    value: float | None = None
    bound: float | None = None
    unit: str | None = None
    surface_no: int | None = None
    arc_no: int | None = None


@dataclass(frozen=True)
class Mesh:
    """Triangles of a shape: `shape_mesh`.  deviation_mm: greatest measured distance from the surfaces; NaN unknown."""

    chord_mm: float
    chord_rad: float
    vertices: Floats  # (n, 3)
    normals: Floats32  # (n, 3) outward, of the exact surface
    triangles: Ints32  # (m, 3) counter-clockwise from outside
    triangle_surfaces: Ints32  # (m,) surface_no
    deviation_mm: float = float("nan")


@dataclass(frozen=True)
class ArcSamples:
    """Points along arcs: `shape_arc_sample`; row i of each column is arc `arc_no[i]`."""

    arc_no: Ints
    points: Ragged  # x y z after each other
    tangents: Ragged
    normals_a: Ragged
    normals_b: Ragged


@dataclass(frozen=True)
class Shape:
    """Geometry in a frame of its own.

    surfaces: columns of `surface` (without identity and keys), `name` of `shape_surface`, and `colour`, `layer` and,
        where there is one, `finish`, which become attributes; row = surface_no.  -1 stands for none in ordinals here,
        and is NULL in the store.
    surface_splines: columns of `surface_spline`, `surface_no` for the identity.
    surface_swept: columns of `surface_swept`, with `surface_no`, `basis_arc` (row of `basis_arcs`) and
        `basis_surface` (row of `basis_surfaces`); -1 is none.
    arcs: columns of `arc` (without identity and keys) and `surface_a`, `surface_b` (-1 is none), `convexity`, `angle`
        of `shape_arc`; row = arc_no.  `tolerance` (mm), where there is one, is what the CAD kernel states for an edge
        and its ends.
    arc_splines: columns of `arc_spline`, `arc_no` for the identity.
    loops, coedges: columns of the tables, with `surface_no` and `arc_no` for identities; `tolerance` of coedges is
        there once the shape is validated (`validation.py`).
    pcurves: curves of coedges in the (u, v) domain of their surfaces, as `readers/step/faces.py` has them; not stored.
    arc_offsets: columns of `arc_offset`, `arc_no` for the identity and `basis_arc` (row of `basis_arcs`).
    basis_*: curves and surfaces that swept and offset ones are made from, same columns as arcs and surfaces; one that
        is itself made from others refers to rows before it."""

    kind: Literal["solid", "sheet", "mesh"]
    volume: float | None
    surfaces: Table
    arcs: Table
    mesh: Mesh
    samples: ArcSamples
    surface_splines: Table = field(default_factory=dict)
    surface_swept: Table = field(default_factory=dict)
    arc_splines: Table = field(default_factory=dict)
    arc_offsets: Table = field(default_factory=dict)
    loops: Table = field(default_factory=dict)
    coedges: Table = field(default_factory=dict)
    pcurves: Table = field(default_factory=dict)
    basis_arcs: Table = field(default_factory=dict)
    basis_arc_splines: Table = field(default_factory=dict)
    basis_arc_offsets: Table = field(default_factory=dict)
    basis_surfaces: Table = field(default_factory=dict)
    basis_surface_splines: Table = field(default_factory=dict)
    basis_surface_swept: Table = field(default_factory=dict)
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class Pmi:
    """A dimension, tolerance or datum: `part_pmi`, `part_pmi_datum` and `part_pmi_surface`.

    datums: precedence, letter and modifier; of a datum its own letter.  surfaces: surface_no and role."""

    kind: str
    type: str
    name: str
    value: float | None = None
    lower_limit: float | None = None
    upper_limit: float | None = None
    unit: str | None = None
    stated_unit: str | None = None
    modifier: str | None = None
    zone: str | None = None
    datums: tuple[tuple[int, str, str | None], ...] = ()
    surfaces: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True)
class Part:
    """A product and the shape (index into `Model.shapes`) that it has."""

    number: str
    name: str
    shape: int
    material: str | None = None
    colour: str | None = None
    attributes: tuple[Attribute, ...] = ()
    pmi: tuple[Pmi, ...] = ()
    findings: tuple[Finding, ...] = ()


@dataclass(frozen=True)
class Instance:
    """A part or assembly (index into that list of the model) placed in an assembly."""

    name: str
    kind: Literal["part", "assembly"]
    child: int
    parent_from_child: Floats  # (4, 4)
    colour: str | None = None


@dataclass(frozen=True)
class Assembly:
    """A product made of others; instances in the order of the file.  joints move its instances, which are named after
    the links and placed as they are with all joints at rest."""

    name: str
    instances: tuple[Instance, ...]
    attributes: tuple[Attribute, ...] = ()
    joints: tuple[Joint, ...] = ()

    @property
    def kind(self) -> Literal["assembly", "robot"]:
        return "robot" if self.joints else "assembly"


@dataclass(frozen=True)
class SourceFile:
    """A file by its name (without folder) and the SHA-256 of its bytes."""

    name: str
    sha256: str


@dataclass(frozen=True)
class Model:
    """All of one file.  The root is `assemblies[root]`; a file with a single part has an assembly around it.

    faces_in_file: by the file's text; None where the format has no such count.  findings: of the file as a whole.
    files: what was read, the file itself first."""

    format: str
    unit: str
    unit_mm: float
    shapes: tuple[Shape, ...]
    parts: tuple[Part, ...]
    assemblies: tuple[Assembly, ...]
    root: int
    faces_loaded: int
    loader_version: str
    schema_name: str | None = None
    faces_in_file: int | None = None
    findings: tuple[Finding, ...] = ()
    files: tuple[SourceFile, ...] = ()


# Attributes that a model states, as rows: of parts, assemblies, and of the faces and edges of shapes.

FACE_LABELS = ("colour", "layer", "finish")
EDGE_LABELS = ("name", "colour", "layer")


def part_attributes(part: Part) -> list[Attribute]:
    """Material, colour and further attributes of a part."""
    labels = (("material", part.material), ("colour", part.colour))
    return [*((name, value, None) for name, value in labels if value is not None), *part.attributes]


def attribute_rows(owners: Iterable[tuple[int, Iterable[Attribute]]]) -> tuple[list[int], Table]:
    """Owner and value columns of each attribute; of several values of one name the last."""
    rows = [(i, *given) for i, attributes in owners for given in {a[0]: a for a in attributes}.values()]
    values = [value for _, _, value, _ in rows]
    return [i for i, *_ in rows], {
        "name": [name for _, name, _, _ in rows],
        "value_number": [None if isinstance(v, str | bool) else float(v) for v in values],
        "value_text": [v if isinstance(v, str) else None for v in values],
        "value_boolean": [v if isinstance(v, bool) else None for v in values],
        "unit": [unit for *_, unit in rows],
    }


def labels(shape: Shape, level: str) -> Table:
    """What a file says in text of the faces or edges of a shape: columns of `surface_attribute` or `arc_attribute`,
    which `level` says; empty where it says nothing."""
    table, names = (shape.surfaces, FACE_LABELS) if level == "surface" else (shape.arcs, EDGE_LABELS)
    found = [(no, name, str(value)) for name in names for no, value in enumerate(table.get(name, ())) if value]
    return dict(by_column(f"{level}_no name value_text", found)) if found else {}
