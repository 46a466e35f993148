"""What an inspection found as a results document of QIF 3 (ISO 23952): characteristics with nominal, limit and result.

The subset: a characteristic of attributes for each part and feature (its state), one of the fitting kind for each size
measured of it; of each its definition (limits), nominal, item (a name that stays from run to run) and measurement with
status, value and standard uncertainty.  There are no product, features, devices or plan.  The order of elements is that
of the standard's schema files, which require a specification that characteristics are judged by: here this program's.
"""

from __future__ import annotations

import uuid
from collections import Counter
from collections.abc import Iterator
from itertools import count
from pathlib import Path
from typing import TYPE_CHECKING, Any
from xml.etree import ElementTree as ET

import relmodel
from relmodel.paths import check_writable
from relmodel.text import visible

if TYPE_CHECKING:
    import pyarrow as pa

NAMESPACE = "http://qifstandards.org/xsd/qif3"
_STATES = {"as modelled": ("confirmed",), "not as modelled": ("changed", "contradicted")}
_KINDS = {"diameter": "Diameter", "thickness": "Thickness", "width": "Width"}


def write_qif(tables: dict[str, pa.Table], path: Path) -> None:
    """Write the results of an inspection, the tables of `read_results`."""
    check_writable(path, "file")
    (about,) = tables["inspection"].to_pylist()
    root = ET.Element("QIFDocument", {"xmlns": NAMESPACE, "versionQIF": "3.0.0"})
    _add(root, "QPId", str(uuid.uuid5(uuid.NAMESPACE_URL, f"relmodel:{about['store_id']}:{about['run']}")))
    header = _add(root, "Header")
    _add(_add(header, "Application"), "Name", f"relmodel {relmodel.__version__}")
    _add(header, "Description", f"run {about['run']} of the cell {about['cell']}, world {about['world']}")
    numbers = count(1)
    standard = _add(_add(root, "StandardsDefinitions", n="1"), "Standard", id=str(next(numbers)))
    _add(_add(standard, "Organization"), "OtherStandardsOrganization", "relmodel")
    _add(standard, "Designator", "as modelled")
    units = _add(_add(root, "FileUnits"), "PrimaryUnits")
    for kind, si, name, factor in (
        ("AngularUnit", "radian", "deg", "0.017453292519943295"),
        ("LinearUnit", "meter", "mm", "0.001"),
    ):
        unit = _add(units, kind)
        _add(unit, "SIUnitName", si)
        _add(unit, "UnitName", name)
        _add(_add(unit, "UnitConversion"), "Factor", factor)

    characteristics = _add(root, "Characteristics")
    _add(characteristics, "FormalStandardId", standard.get("id"))
    blocks = {name: _add(characteristics, f"Characteristic{name}s") for name in ("Definition", "Nominal", "Item")}
    result = _add(_add(_add(root, "Results"), "MeasurementResultsSet", n="1"), "MeasurementResults")
    result.set("id", str(next(numbers)))
    of_result = _add(result, "MeasuredCharacteristics")
    measured = _add(of_result, "CharacteristicMeasurements")
    _add(_add(result, "InspectionStatus"), "InspectionStatusEnum", _verdict(about))
    sizes: dict[str, list[dict[str, Any]]] = {}
    for row in tables["measured_size"].to_pylist():
        sizes.setdefault(row["path"], []).append(row)
    for row in tables["presence"].to_pylist():
        if row["level"] != "surface":
            _add_state(row, blocks, measured, numbers)
            seen: Counter[str] = Counter()
            for size in sizes.get(row["path"], ()):
                seen[size["what"]] += 1  # of several faces each has an offset
                name = f"{row['path']}/{size['what']}" + (f" {seen[size['what']]}" if seen[size["what"]] > 1 else "")
                _add_size(name, size, blocks, measured, numbers)
    for block in (*blocks.values(), measured):
        block.set("n", str(len(block)))
    if not len(measured):  # the standard has no empty lists
        root.remove(characteristics)
        result.remove(of_result)
    root.set("idMax", str(next(numbers) - 1))
    ET.indent(root)
    ET.ElementTree(root).write(path, encoding="utf-8", xml_declaration=True)


def _add_state(
    row: dict[str, Any], blocks: dict[str, ET.Element], measured: ET.Element, numbers: Iterator[int]
) -> None:
    """The state of a part or feature."""
    kind = "UserDefinedAttribute"
    definition, nominal, _, measurement = _add_four(kind, row["path"], row["qif"], blocks, measured, numbers)
    _add(definition, "WhatToMeasure", "is as modelled")
    for name, words in (("PassValues", "as modelled"), ("FailValues", "not as modelled")):
        _add(_add(nominal, name, n="1"), "StringValue", words)
    said = next((words for words, states in _STATES.items() if row["state"] in states), None)
    if said is not None:  # what was not checked has no value
        _add(measurement, "Value", said)


def _add_size(
    name: str, row: dict[str, Any], blocks: dict[str, ET.Element], measured: ET.Element, numbers: Iterator[int]
) -> None:
    """A size of it; without a limit of its own the odds decided, and the definition has none."""
    kind = _KINDS.get(row["what"], "UserDefinedAngular" if row["unit"] == "deg" else "UserDefinedLinear")
    undecided = row["state"] == "undecidable"
    status = "NOT_ANALYZED" if undecided else "FAIL" if row["changed"] else "PASS"
    definition, nominal, _, measurement = _add_four(kind, name, status, blocks, measured, numbers)
    if row["least_difference"] is None:
        _add(definition, "NonTolerance", "MEASURED")
    else:
        tolerance = _add(definition, "Tolerance")
        _add(tolerance, "MaxValue", _number(row["least_difference"]))
        _add(tolerance, "MinValue", _number(-row["least_difference"]))
        _add(tolerance, "DefinedAsLimit", "false")
    if kind.startswith("UserDefined"):
        _add(definition, "WhatToMeasure", row["what"])
    _add(nominal, "TargetValue", _number(row["nominal"]))
    # The standard has both attributes or none.
    known = {"combinedUncertainty": _number(row["sigma"]), "meanError": "0"}
    _add(measurement, "Value", _number(row["value"]), **known)


def _add_four(
    kind: str, name: str, status: str, blocks: dict[str, ET.Element], measured: ET.Element, numbers: Iterator[int]
) -> tuple[ET.Element, ET.Element, ET.Element, ET.Element]:
    """Definition, nominal, item and measurement of a characteristic, each named by the next."""
    ids = [str(next(numbers)) for _ in range(4)]
    definition, nominal, item = (
        _add(blocks[what], f"{kind}Characteristic{what}", id=number)
        for what, number in zip(("Definition", "Nominal", "Item"), ids, strict=False)
    )
    _add(nominal, "CharacteristicDefinitionId", ids[0])
    _add(item, "Name", visible(name))
    _add(item, "CharacteristicNominalId", ids[1])
    measurement = _add(measured, f"{kind}CharacteristicMeasurement", id=ids[3])
    _add(_add(measurement, "Status"), "CharacteristicStatusEnum", status)
    _add(measurement, "CharacteristicItemId", ids[2])
    return definition, nominal, item, measurement


def _verdict(about: dict[str, Any]) -> str:
    """Whether the part passes, in QIF's words: unchecked is never passed."""
    if about["part_verdict"] in ("deviates", "another variant"):
        return "FAIL"
    return "PASS" if about["part_verdict"] == "as modelled" and about["checked"] == about["in_view"] else "UNKNOWN"


def _add(parent: ET.Element, name: str, text: str | None = None, **attributes: str) -> ET.Element:
    made = ET.SubElement(parent, name, attributes)
    made.text = text
    return made


def _number(value: float) -> str:
    """As XML Schema spells decimals: without an exponent."""
    return f"{value:.9f}".rstrip("0").rstrip(".")
