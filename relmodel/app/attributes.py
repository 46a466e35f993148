"""Attributes that a person sets: of worlds, objects, parts, and of surfaces and arcs of parts.

Each is appended in a run of its own, which says who set what and when; the newest value wins."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, TypedDict

from relmodel.errors import UsageError
from relmodel.model.model import attribute_rows
from relmodel.names import nearest_name
from relmodel.resources import user_name
from relmodel.store import Run, Store

if TYPE_CHECKING:
    from sqlalchemy import Connection

Value = float | str | bool

_LONGEST_NAME = 200  # characters of a name
_DENSITIES = 10.0, 25_000.0  # of materials, kg/m3: from light foam to beyond osmium
_COMMA = re.compile(r"[-+]?[\d.' ]*,[\d.]+(?:[eE][-+]?\d+)?")  # 2,70 or 2.700,5 or 2,700.5
_COLOUR = re.compile(r"#[0-9a-f]{6}")


@dataclass(frozen=True)
class _FixedMeaning:
    """An attribute whose meaning is fixed: of which levels it is, and of which dimension (None: a text)."""

    levels: tuple[str, ...]
    dimension: str | None = None


# Names that views and pictures read; every other name is free.
_KNOWN = {
    "density": _FixedMeaning(("part",), "density"),
    "mass": _FixedMeaning(("object", "part"), "mass"),
    "material": _FixedMeaning(("part",)),
    "finish": _FixedMeaning(("part", "surface")),
    "colour": _FixedMeaning(("part", "surface", "arc")),
    "layer": _FixedMeaning(("part", "surface", "arc")),
}
# What inspections read of an object as its world places it, which an attribute would not change.
_OF_WORLD_FILE = ("tolerance_mm", "role", "joints", "world_from_object")


@dataclass(frozen=True)
class Owner:
    """What has an attribute.  id: the world, object or part; of a surface or arc its shape, in which it is number
    `element_no`.  volume: of a part, mm3, where it encloses one."""

    level: str
    id: int
    element_no: int | None
    words: str
    volume: float | None = None

    @property
    def key(self) -> dict[str, Any]:
        """Key columns of the level's attribute table."""
        if self.element_no is None:
            return {f"{self.level}_id": self.id}
        return {"shape_id": self.id, f"{self.level}_no": self.element_no}


@dataclass(frozen=True)
class Setting:
    """By which run an attribute was set, and of what."""

    run_id: int
    owner: Owner


class AttributeOwner(TypedDict, total=False):
    """What of an object, or of what stands in it, an attribute is of.

    variant: of the object.  surface, arc: of the part, by number.  world: the path is the name of a world, whose newest
    revision is meant."""

    variant: str
    surface: int | None
    arc: int | None
    world: bool


def set_attribute(
    store: Store, path: str, name: str, value: Value, unit: str | None, whose: AttributeOwner, *, text: bool = True
) -> Setting:
    """Set an attribute of what a path names: an object, or OBJECT/PATH of what stands in it; or of a world.

    Without `text` a value such as 2,70 is a number gone wrong.  Raises UsageError where the path leads nowhere or name,
    value and unit do not fit."""
    whose = {"variant": "", "surface": None, "arc": None, "world": False, **whose}
    parameters: dict[str, Any] = {"path": path, **whose, "name": name, "value": value, "unit": unit}
    parameters["user"] = user_name()
    with Run.begin(store, "set", parameters) as run:
        with store.read() as connection:
            known = store.select(connection, "unit_of_measure", order="dimension factor")
            units = dict(zip(known["symbol"], zip(known["dimension"], known["factor"], strict=True), strict=True))
            owner = _owner(store, connection, path, whose)
        _check(owner, name, value, unit, units, text)
        _, columns = attribute_rows([(owner.id, [(name, value, unit)])])
        row = {key: [number] for key, number in owner.key.items()}

        def write(connection: Connection) -> None:
            run.append(connection, f"{owner.level}_attribute", {**row, "run_id": run.id, "source": "user", **columns})
            run.finish(f"{name} of {owner.words} is set", connection)

        run.transact(write)
    return Setting(run.id, owner)


def _owner(store: Store, connection: Connection, path: str, whose: AttributeOwner) -> Owner:
    from relmodel.app.tree import read_tree
    from relmodel.find.find import world_named

    variant, surface, arc = whose["variant"], whose["surface"], whose["arc"]
    if whose["world"]:
        if variant or surface is not None or arc is not None:
            raise UsageError("a world has no variant, surface or arc: leave them out")
        world_id, found = world_named(store, connection, path)
        return Owner("world", world_id, None, f"world {found}")
    if surface is not None and arc is not None:
        raise UsageError("an attribute is of a surface or of an arc: name one of them")
    loaded = {row.name for row in store.rows(connection, "object/newest", run=None)}
    name = max((n for n in loaded if path == n or path.startswith(f"{n}/")), key=len, default=path.partition("/")[0])
    tree = read_tree(store, connection, name, variant)
    inside = path[len(name) + 1 :]
    called = f"{name} variant {tree.variant}" if tree.variant else name
    if inside and inside not in tree.path:
        near = nearest_name(inside, tree.path)
        hint = f"did you mean {name}/{near}?" if near else f"relmodel show {name} lists what there is"
        raise UsageError(f"there is no {inside} in {called}: {hint}")
    at = tree.path.index(inside) if inside else -1
    if at < 0 or tree.part_id[at] < 0:
        if surface is not None or arc is not None:
            raise UsageError(f"{path} is an object, and surfaces and arcs are of parts: give the path of a part in it")
        return Owner("object", tree.object_id if at < 0 else int(tree.child_object_id[at]), None, f"object {path}")
    part = store.rows(connection, "object/parts", part_ids=[int(tree.part_id[at])])[0]
    words = f"part {part.number}"
    for level, number, count in (("surface", surface, part.surface_count), ("arc", arc, part.arc_count)):
        if number is not None:
            if not 0 <= number < count:
                raise UsageError(f"{words} has no {level} {number}: it has {level}s 0 to {count - 1}")
            return Owner(level, int(part.shape_id), number, f"{level} {number} of {words}")
    return Owner("part", int(part.id), None, words, part.volume)


def _check(owner: Owner, name: str, value: Value, unit: str | None, units: dict[str, Any], text: bool) -> None:
    """Raise UsageError where name, value and unit of an attribute do not fit together."""
    if not name.strip() or name != name.strip() or len(name) > _LONGEST_NAME or not name.isprintable():
        raise UsageError(
            f"invalid attribute name {name!r}: give 1 to {_LONGEST_NAME} characters without spaces at the ends"
        )
    number = isinstance(value, int | float) and not isinstance(value, bool)
    if isinstance(value, str) and (not value.strip() or "\0" in value):
        raise UsageError(f"the value of {name} is empty: give a number, a text, true or false")
    if number and not math.isfinite(value):  # type: ignore[arg-type]
        raise UsageError(f"the value of {name} is {value}: give a finite number")
    meant = _KNOWN[name].dimension is not None if name in _KNOWN else not text  # a number
    if (meant or unit is not None) and isinstance(value, str) and _COMMA.fullmatch(value):
        raise UsageError(f"{name} {value} has a comma where a number has a point: write a point, or give it as a text")
    if unit is not None and not number:
        raise UsageError(f"the value of {name} is {value!r}, not a number: leave the unit {unit!r} out")
    if unit is not None and unit not in units:
        raise UsageError(f"the unit {unit!r} is unknown: use one of {', '.join(units)}")
    if name.lower() in _OF_WORLD_FILE:
        raise UsageError(
            f"{name} is read from the world file: write it there beside the object and place it again, with relmodel "
            "world FILE"
        )
    if name in _KNOWN:
        _check_known(owner, name, value, unit, units)


def _check_known(owner: Owner, name: str, value: Value, unit: str | None, units: dict[str, Any]) -> None:
    known = _KNOWN[name]
    if owner.level not in known.levels:
        raise UsageError(f"{name} applies to a {' or '.join(known.levels)}, and {owner.words} is not one: name one")
    if known.dimension is None:
        if not isinstance(value, str):
            raise UsageError(f"{name} takes a text, not {value!r}: give its name (--text if it looks like a number)")
        if name == "colour" and not _COLOUR.fullmatch(value):
            raise UsageError(f"the colour {value!r} is not #rrggbb: give six hexadecimal digits, as in #c0c0c0")
        return
    fitting = ", ".join(symbol for symbol, (of, _) in units.items() if of == known.dimension)
    if isinstance(value, str | bool) or not value > 0:
        raise UsageError(f"{name} takes a number above zero, not {value!r}: give one with its unit ({fitting})")
    if unit is None or units[unit][0] != known.dimension:
        given = "has no unit" if unit is None else f"has the unit {unit}, which is one of {units[unit][0]}"
        raise UsageError(f"the {name} {value:g} {given}: give one of {fitting}")
    per_volume = 1.0 if name == "density" else 1e9 / owner.volume if owner.volume else 0.0
    density = value * units[unit][1] * per_volume  # kg/m3
    if density > _DENSITIES[1] or (name == "density" and density < _DENSITIES[0]):
        raise UsageError(
            f"with the {name} {value:g} {unit}, {owner.words} would have {density:.3g} kg/m3, and materials have "
            f"{_DENSITIES[0]:g} to {_DENSITIES[1]:g}: check the number and its unit"
        )
