"""Attributes that a model states, as rows: of parts, assemblies, and of the faces and edges of shapes."""

from __future__ import annotations

from collections.abc import Iterable

from relmodel.columns import by_column
from relmodel.model.model import Attribute, Part, Shape, Table

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


def surface_attributes(shape: Shape) -> Table:
    """Colours, layers and finishes of the faces of a shape: columns of `surface_attribute`; empty where it has none."""
    return _labels(shape.surfaces, FACE_LABELS, "surface_no")


def arc_attributes(shape: Shape) -> Table:
    """Names, colours and layers of the edges of a shape: columns of `arc_attribute`; empty where it has none."""
    return _labels(shape.arcs, EDGE_LABELS, "arc_no")


def _labels(table: Table, names: tuple[str, ...], ordinal: str) -> Table:
    found = [(no, name, str(value)) for name in names for no, value in enumerate(table.get(name, ())) if value]
    return dict(by_column(f"{ordinal} name value_text", found)) if found else {}
