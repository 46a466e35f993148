"""The features of the demonstration bulkhead's variants against the golden tables that their generator wrote."""

from __future__ import annotations

import json
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from relmodel.features import Feature, recognise
from tests.reading import shared

EXAMPLES = Path(__file__).parents[2] / "examples"

Row = dict[str, Any]


def missed_and_false(variant: str) -> tuple[list[str], list[str]]:
    """Of the body of a variant: what of its list is not found, and what is found that is not on it; patterns have no
    row, nor has the body."""
    folder = "demo" if variant in "AB" else "bulkhead/variants"
    model = shared(EXAMPLES / folder / f"bulkhead_{variant}.step.gz")
    rows = json.loads((EXAMPLES / f"bulkhead/golden/bulkhead_{variant}.json").read_text())["features"]
    (body,) = (p.shape for p in model.parts if "BODY" in p.name)
    left = [f for f in recognise(model.shapes[body]) if f.kind != "body" and not f.kind.endswith("_pattern")]
    missed = []
    for row, kind, is_it in _expected(rows):
        hit = next((f for f in left if f.kind == kind and is_it(f)), None)
        if hit is None:
            missed.append(f"{kind} {row['name']}")
        left = [f for f in left if f is not hit]
    return missed, [f.name for f in left]


def _expected(rows: list[Row]) -> list[tuple[Row, str, Callable[[Feature], bool]]]:
    """Of each feature its row, its kind and what tells it.

    What a row names together is several features: a lug or boss and its bore, a duct and its ring on either side,
    pockets and the web under them.  A wall of the plan is a rib where it has pockets on both hands.
    """
    kinds = {"pocket": "pocket", "rib": "rib", "lowered_rib": "open_slot", "lug": "lug", "boss": "boss"}
    pockets = [r for r in rows if r["kind"] == "pocket"]
    out: list[tuple[Row, str, Callable[[Feature], bool]]] = []
    for row in rows:
        if row["kind"] == "rib" and not _parts_pockets(row, pockets):
            continue
        if row["kind"].endswith("_hole"):
            kind = "through_hole" if row["through"] else "blind_hole"
        elif row["kind"] == "duct":
            kind = "duct" if row["semi_axes"][0] != row["semi_axes"][1] else "through_hole"
        else:
            kind = kinds[row["kind"]]
        out.append((row, kind, partial(is_golden, row)))
        if row["kind"] in ("lug", "boss"):
            centre, radius = (row["bore_centre"], row["bore_radius"]) if kind == "lug" else (row["centre"], row["bore"])
            out.append((row, "through_hole", partial(_is_round, centre, radius)))
        if row["kind"] == "duct":
            around = [r for r in pockets if r["name"].split(".")[0] == row["pocket"]]
            out += [(row, "boss", partial(_is_at, row["centre"])) for _ in around]
    for row in pockets:
        cell, side = row["name"].split(".")
        other = [r for r in pockets if r["name"].startswith(f"{cell}.back")]
        if side != "front" or not other:
            out.append((row, "web", partial(_is_web, row)))
    return out


def _parts_pockets(rib: Row, pockets: list[Row]) -> bool:
    start, end = np.array(rib["start"]), np.array(rib["end"])
    across = np.array([start[1] - end[1], end[0] - start[0]])
    hands = {
        (p["side"], bool((np.array([p["box"][0] + p["box"][3], p["box"][1] + p["box"][4]]) / 2 - start) @ across > 0))
        for p in pockets
        if rib["name"] in p["walls"]
    }
    return any({(side, True), (side, False)} <= hands for side in ("front", "back"))


def measures(feature: Feature) -> dict[str, float]:
    return {name: value for name, (value, _) in feature.dimensions.items()}


def _is_round(centre: list[float], radius: float, feature: Feature) -> bool:
    return bool(abs(measures(feature)["diameter"] - 2 * radius) < 0.01 and _is_at(centre, feature))


def _is_at(centre: list[float], feature: Feature) -> bool:
    return _near(feature.shape_from_feature[:2, 3], centre)


def _is_web(row: Row, feature: Feature) -> bool:
    x, y = feature.shape_from_feature[:2, 3]
    box = row["box"]
    inside = box[0] < x < box[3] and box[1] < y < box[4]
    return bool(inside and abs(measures(feature)["thickness"] - row["web_thickness"]) < 0.01)


def is_golden(row: dict[str, Any], feature: Feature) -> bool:
    """Whether a feature is that of a row of the golden list: kind, place and dimensions."""
    m, kind, at = measures(feature), row["kind"], feature.shape_from_feature[:2, 3]

    def close(name: str, value: float, tolerance: float = 0.01) -> bool:
        return abs(m.get(name, np.inf) - value) < tolerance

    if kind.endswith("_hole"):
        right = feature.kind == ("through_hole" if row["through"] else "blind_hole")
        span = np.abs(feature.box[[2, 5]] - [row["box"][2], row["box"][5]]).max() < 0.01
        return bool(right and span and close("diameter", 2 * row["radius"]) and _near(at, row["centre"]))
    if kind == "pocket":
        right = (
            feature.kind == "pocket" and close("depth", row["depth"]) and close("corner_radius", row["corner_radius"])
        )
        rounded = close("fillet_radius", row["floor_radius"]) or row["floor_radius"] == 0
        return bool(right and rounded and np.abs(feature.box - row["box"]).max() < 0.5)
    if kind == "rib":
        start, end = np.array(row["start"]), np.array(row["end"])
        across = np.array([start[1] - end[1], end[0] - start[0]]) / np.linalg.norm(end - start)
        in_line = abs((at - start) @ across) < 0.01 and abs(feature.shape_from_feature[:2, 0] @ across) < 1e-4
        return bool(feature.kind == "rib" and close("thickness", row["thickness"]) and in_line)
    if kind == "lowered_rib":
        deep = row["box"][5] - row["box"][2]
        return feature.kind == "open_slot" and close("width", row["span"][1] - row["span"][0]) and close("depth", deep)
    if kind == "lug":
        bored = close("bore_diameter", 2 * row["bore_radius"]) and close("width", row["width"])
        return feature.kind == "lug" and bored and _near(at, row["bore_centre"])
    if kind == "boss":
        return feature.kind == "boss" and close("diameter", 2 * row["radius"]) and _near(at, row["centre"])
    a, c = (2 * semi for semi in row["semi_axes"])
    shaped = (close("major_diameter", a) and close("minor_diameter", c)) if a != c else close("diameter", a)
    return feature.kind == ("duct" if a != c else "through_hole") and shaped and _near(at, row["centre"])


def _near(at: Any, centre: list[float]) -> bool:
    return bool(np.linalg.norm(at - centre) < 0.01)
