"""Geometry that is the same but for the last digits of its numbers is stored once."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

from relmodel.model.model import Model
from relmodel.store import Store
from tests.parts.solids import box, cylinder
from tests.parts.step_parts import loaded, write_product
from tests.reading import store_model


def jittered(text: str, rng: np.random.Generator) -> str:
    """Every coordinate of every point off by up to 1e-7 mm."""

    def noisy(match: re.Match[str]) -> str:
        values = [float(v) + rng.uniform(-1e-7, 1e-7) for v in match.group(2).split(",")]
        return match.group(1) + ",".join(repr(v) for v in values) + match.group(3)

    return re.sub(r"(CARTESIAN_POINT\('[^']*',\()([^()]*)(\)\))", noisy, text)


def test_noise_is_told_from_changes(duckdb_file: Path, tmp_path: Path) -> None:
    """Of a noisy export with one hole a little wider only what touches the hole is new, and the next one is like it."""

    def export(name: str, radius: float, seed: int) -> Model:
        body = BRepAlgoAPI_Cut(box((0, 0, 0), (60, 40, 8)), cylinder((13, 17, -1), 6, 10)).Shape()
        body = BRepAlgoAPI_Cut(body, cylinder((41, 21, -1), radius, 10)).Shape()
        path = write_product(tmp_path / name, body, "PLATE")
        path.write_text(jittered(path.read_text(), np.random.default_rng(seed)))
        return loaded(path)

    with Store.open(duckdb_file) as store:
        plain = store_model(store, export("plain.step", 5, 1), "thing", "A")
        assert (plain.shapes_added, plain.surfaces_added) == (1, 8)
        wider = store_model(store, export("wider.step", 5.001, 2), "thing", "B")
        assert (wider.shapes_added, wider.surfaces_added, wider.arcs_added) == (1, 3, 3)
        for seed, (radius, like) in enumerate([(5, plain), (5.001, wider)], start=3):
            again = store_model(store, export(f"{seed}.step", radius, seed), "thing", f"{seed}")
            assert (again.object_id, again.surfaces_added, again.arcs_added) == (like.object_id, 0, 0)
