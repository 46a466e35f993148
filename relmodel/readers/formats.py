"""Formats of model files by their suffixes, and the unit of length that some of them leave open.

Imports nothing heavy: what a call asks for is looked at before a reader is begun."""

from __future__ import annotations

from pathlib import Path

from relmodel.errors import InputError

STEP_SUFFIXES = (".step", ".stp", ".p21")
URDF_SUFFIX = ".urdf"
UNITLESS_FORMATS = ("obj", "stl", "ply")
MESH_FORMATS = (*UNITLESS_FORMATS, "glb", "gltf", "3mf")
UNITS_MM = {"um": 1e-3, "mm": 1.0, "cm": 10.0, "dm": 100.0, "m": 1e3, "in": 25.4, "ft": 304.8}

FULL_UNITS = {"um": "micrometre", "mm": "millimetre", "cm": "centimetre", "dm": "decimetre", "m": "metre"}
FULL_UNITS |= {"in": "inch", "ft": "foot"}
_LONG_UNITS = {full: short for short, full in FULL_UNITS.items()} | {"micron": "um", "inches": "in", "feet": "ft"}
_LONG_UNITS |= {"millimeter": "mm", "centimeter": "cm", "decimeter": "dm", "meter": "m"}


def format_of(path: Path) -> str:
    """`step`, `mesh` or `urdf`, by the suffix, that of the file within a `.gz` of STEP.

    Raises InputError for an unknown one."""
    suffix = path.suffix.lower()
    if suffix in STEP_SUFFIXES or (suffix == ".gz" and Path(path.stem).suffix.lower() in STEP_SUFFIXES):
        return "step"
    if suffix == URDF_SUFFIX:
        return "urdf"
    if suffix[1:] in MESH_FORMATS:
        return "mesh"
    known = ", ".join([*STEP_SUFFIXES, *(f".{f}" for f in MESH_FORMATS), URDF_SUFFIX])
    raise InputError(f"{path.name} is of an unknown format: give a file named {known}, or .step.gz")


def stem_of(path: Path) -> str:
    """Name of a model file without its suffix, or both of a packed one: pump.10.201 of pump.10.201.step.gz."""
    return path.with_suffix("").stem if path.suffix.lower() == ".gz" else path.stem


def check_unit(path: Path, unit: str | None) -> None:
    """Raise InputError where the format needs a unit and none is given, or states one and another is given."""
    unitless = path.suffix[1:].lower() in UNITLESS_FORMATS
    if unitless and unit is None:
        raise InputError(f"{path.name} states no unit of length: give one, such as --unit mm")
    if not unitless and unit is not None:
        raise InputError(f"{path.name} states its own unit of length: leave --unit out")
    if unit is not None and short_unit(unit) not in UNITS_MM:
        raise InputError(f"{unit!r} is not a unit of length for {path.name}: use one of {', '.join(UNITS_MM)}")


def known_unit(file: str, stated: str) -> str:
    """The unit that a file states, as UNITS_MM has it.  Raises InputError where that has none such."""
    short = short_unit(stated)
    if short not in UNITS_MM:
        raise InputError(f"{file} is in an unknown unit {stated!r}: use one of {', '.join(UNITS_MM)}")
    return short


def short_unit(unit: str) -> str:
    """A unit as UNITS_MM has it, of one that may be spelled out."""
    unit = unit.lower()
    return _LONG_UNITS.get(unit, _LONG_UNITS.get(unit.removesuffix("s"), unit))
