"""What files state of parts and faces, and what a person sets of them, as attributes: the newest value counts."""

from __future__ import annotations

import json
import math
from dataclasses import replace
from functools import cache
from pathlib import Path
from typing import Any, cast

import numpy as np
import pytest

from relmodel.app.attributes import AttributeOwner, set_attribute
from relmodel.app.cli.main import main
from relmodel.errors import UsageError
from relmodel.model.model import Assembly, Attribute, Instance, Model, Part, Pmi, Shape
from relmodel.names import visible
from relmodel.readers import urdf
from relmodel.store import Store
from relmodel.store.check import check
from relmodel.world import place_world
from tests.app.cli.conftest import asked
from tests.given import Capsys, CopyStore, NewStore
from tests.reading import store_model
from tests.synthetic_model import write_world

LB = 0.45359237  # kg, by definition


@cache
def labelled_box() -> Shape:
    """A box of 100 x 200 x 50 mm, two of its faces red, one on a layer, and an edge with a name."""
    shape = urdf.primitive("box", 100, 200, 50)
    labels = {"colour": ["#ff0000", None, "#ff0000", None, None, None], "layer": [None, "mating", *[None] * 4]}
    names = {"name": ["datum edge", *[None] * (len(shape.arcs["kind"]) - 1)]}
    return replace(shape, surfaces=shape.surfaces | labels, arcs=shape.arcs | names)


def filled(store: Store, density: float = 2.7, variant: str = "A") -> None:
    """A box with attributes as a file states them, twice in an object, and a pin without any."""
    stated: list[Attribute] = [("density", density * 1000, "kg/m3"), ("revision", "C", None), ("released", True, None)]
    datums = ((1, "A", None), (2, "B", None))
    flat = Pmi("tolerance", "flatness", "", 0.05, unit="mm", datums=datums, surfaces=((3, "feature"),))
    box = Part("BOX-1", "box", 0, "Al 7075", "#0000ff", tuple(stated), (flat,))
    shapes = (labelled_box(), urdf.primitive("cylinder", 5, 40))
    aside = np.eye(4)
    aside[0, 3] = 300
    placed = [Instance("left", "part", 0, np.eye(4)), Instance("right", "part", 0, aside)]
    inner = Assembly("inner", (Instance("pin", "part", 1, np.eye(4)),), (("mass", 0.5, "kg"),))
    root = Assembly("thing", (*placed, Instance("inner", "assembly", 0, np.eye(4))))
    parts = (box, Part("PIN-1", "pin", 1))
    model = Model("STEP", "mm", 1.0, shapes, parts, (inner, root), 1, 9, "test", "AP242")
    store_model(store, model, "thing", variant)


@pytest.fixture(scope="module", params=["duckdb", "postgresql"])
def template(request: pytest.FixtureRequest, new_store: NewStore, tmp_path_factory: pytest.TempPathFactory) -> str:
    target = new_store(request.param)
    with Store.open(target) as store:
        filled(store)
        world = write_world(tmp_path_factory.mktemp("set") / "w.yaml", "cell", [{"object": "thing", "variant": "A"}])
        place_world(store, world)
    return target


@pytest.fixture
def target(template: str, copy_store: CopyStore) -> str:
    return copy_store(template)


def test_what_the_file_states_becomes_attributes(template: str) -> None:
    with Store.open(template, read_only=True) as store:
        values = "name, value_number, value_text, value_boolean, unit, source"
        assert asked(store, f"SELECT {values} FROM current_part_attribute ORDER BY name") == [  # noqa: S608
            ("colour", None, "#0000ff", None, None, "file"),
            ("density", 2700.0, None, None, "kg/m3", "file"),
            ("material", None, "Al 7075", None, None, "file"),
            ("released", None, None, True, None, "file"),
            ("revision", None, "C", None, None, "file"),
        ]
        query = "SELECT surface_no, name, value_text FROM surface_attribute ORDER BY surface_no"
        assert asked(store, query) == [(0, "colour", "#ff0000"), (1, "layer", "mating"), (2, "colour", "#ff0000")]
        assert asked(store, "SELECT arc_no, name, value_text FROM arc_attribute") == [(0, "name", "datum edge")]
        query = "SELECT o.name, a.name, value_number FROM object_attribute AS a JOIN object AS o ON o.id = object_id"
        assert asked(store, query) == [("inner", "mass", 0.5)]
        ((mass, volume),) = asked(store, "SELECT mass, volume FROM part_mass")
        assert volume == pytest.approx(1e6)  # 100 x 200 x 50
        assert mass == pytest.approx(2.7)
        query = "SELECT surface_no, kind, type, value, unit, datums FROM surface_pmi"
        assert asked(store, query) == [(3, "tolerance", "flatness", 0.05, "mm", "A, B")]


def test_what_a_person_sets_counts_and_is_kept(target: str, capsys: Capsys) -> None:
    def set_one(*words: str) -> str:
        of = () if "--world" in words else ("--variant", "A")
        assert main(["set", *words, *of, "--store", target]) == 0
        return capsys.readouterr().err

    assert "density of part BOX-1 is 0.1 lb/in3" in set_one("thing/left", "density", "0.1", "--unit", "lb/in3")
    # A pound is .45359237 kg, an inch 25.4 mm: the box has 1e6 / 25.4^3 cubic inches.
    assert asked(target, "SELECT mass FROM part_mass")[0][0] == pytest.approx(0.1 * LB * 1e6 / 25.4**3, rel=1e-12)
    set_one("thing/right", "density", "7850", "--unit", "kg/m3")
    assert asked(target, "SELECT mass, source FROM part_mass") == [(pytest.approx(7.85), "user")]
    assert "surface 2 of part BOX-1" in set_one("thing/left", "finish", "anodised", "--surface", "2")
    set_one("thing/left", "deburred", "false", "--arc", "3")
    set_one("thing", "serial", "0042", "--text")
    set_one("thing/inner", "mass", "1.2", "--unit", "lb")
    set_one("cell", "temperature class", "20", "--world")
    query = "SELECT level, surface_no, arc_no, name, value FROM attribute_log WHERE source = 'user' ORDER BY run_id"
    logged = asked(target, query)
    assert [row[:4] for row in logged] == [
        *[("part", None, None, "density")] * 2,
        ("surface", 2, None, "finish"),
        ("arc", None, 3, "deburred"),
        ("object", None, None, "serial"),
        ("object", None, None, "mass"),
        ("world", None, None, "temperature class"),
    ]
    assert [row[4] for row in logged[2:5]] == ["anodised", "false", "0042"]
    by = "SELECT DISTINCT r.kind, stated_by IS NULL FROM attribute_log AS a JOIN run AS r ON r.id = a.run_id"
    assert asked(target, f"{by} WHERE source = 'user'") == [("set", False)]

    assert main(["show", "thing", "--variant", "A", "--format", "json", "--store", target]) == 0
    shown = {row["path"]: row for row in json.loads(capsys.readouterr().out)}
    assert (shown["left"]["mass"], shown["left"]["material"]) == (pytest.approx(7.85), "Al 7075")
    said = shown["left"]["attributes"]
    for words in ("surface 2: finish=anodised", "arc 3: deburred=false", "surface 0, 2: colour=#ff0000"):
        assert words in said
    assert "mass=1.2 lb" in shown["inner"]["attributes"]
    assert shown["inner"]["mass"] is None  # the pin's density is not known
    with Store.open(target) as store:
        assert not [row for result in check(store) for row in result.rows]


def test_what_is_set_stays_with_what_stays(target: str, tmp_path: Path) -> None:
    """Another load of the same part keeps what was set of it; the next revision of a world what was set of that."""
    assert main(["set", "thing/left", "material", "Ti 6Al-4V", "--variant", "A", "--store", target]) == 0
    assert main(["set", "cell", "floor", "3", "--world", "--store", target]) == 0
    with Store.open(target) as store:
        filled(store)
        filled(store, variant="B")
        filled(store, density=4.43, variant="C")  # another part: what its own file says holds
        twice: list[dict[str, object]] = [{"object": "thing", "variant": "A", "name": name} for name in ("one", "two")]
        assert place_world(store, write_world(tmp_path / "w.yaml", "cell", twice)).revision == 2
    query = """SELECT v.variant, a.value_text FROM object_variant AS v
        JOIN object_part AS i ON i.object_id = v.object_id AND i.name = 'left'
        JOIN current_part_attribute AS a ON a.part_id = i.part_id AND a.name = 'material' ORDER BY v.variant"""
    assert asked(target, query) == [("A", "Ti 6Al-4V"), ("B", "Ti 6Al-4V"), ("C", "Al 7075")]
    query = """SELECT w.revision, a.value_number FROM current_world AS w
        JOIN current_world_attribute AS a ON a.world_id = w.world_id AND a.name = 'floor'"""
    assert asked(target, query) == [(2, 3.0)]


KG, PART = "kg/m3", "thing/left"
NONSENSE: list[tuple[tuple[str, str, Any, str | None], dict[str, Any], str]] = [
    ((PART, "density", 2700.0, None), {}, "the density 2700 has no unit: give one of kg/m3"),
    ((PART, "density", 2.7, "mm"), {}, "has the unit mm, which is one of length"),
    ((PART, "density", -3.0, KG), {}, "a number above zero"),
    ((PART, "density", "2,70", "g/cm3"), {}, "density 2,70 has a comma where a number has a point"),
    ((PART, "density", 2700.0, "g/cm3"), {}, "would have 2.7e+06 kg/m3, and materials have 10 to 25"),
    (("thing", "density", 3.0, KG), {}, "density applies to a part, and object thing is not one"),
    ((PART, "mass", 3.0, "stone"), {}, "the unit 'stone' is unknown: use one of"),
    ((PART, "a", math.nan, None), {}, "give a finite number"),
    ((PART, "a", "", None), {}, "is empty"),
    ((PART, "a\x1b[31m", 1.0, None), {}, "invalid attribute name"),
    ((PART, "finish", "rough", "mm"), {}, "not a number: leave the unit 'mm' out"),
    ((PART, "material", 7075.0, None), {}, "material takes a text"),
    ((PART, "colour", "red", None), {}, "is not #rrggbb"),
    (("thing/lift", "a", 1.0, None), {}, "there is no lift in thing variant A: did you mean thing/left?"),
    (("thong", "a", 1.0, None), {}, "there is no object thong variant A"),
    ((PART, "a", 1.0, None), {"surface": 6}, "part BOX-1 has no surface 6: it has surfaces 0 to 5"),
    ((PART, "a", 1.0, None), {"arc": -1}, "part BOX-1 has no arc -1: it has arcs 0 to 11"),
    (("thing/inner", "a", 1.0, None), {"arc": 1}, "surfaces and arcs are of parts"),
    ((PART, "a", 1.0, None), {"arc": 1, "surface": 1}, "name one of them"),
    (("cell", "a", 1.0, None), {"world": True}, "a world has no variant"),
    (("thing", "tolerance_mm", 0.3, None), {}, "tolerance_mm is read from the world file: write it there"),
]


def test_nonsense_is_refused_in_one_sentence(new_store: NewStore, capsys: Capsys) -> None:
    """And leaves the store as it was, but for the run that failed, with that sentence."""
    target, answers = new_store("duckdb"), []
    with Store.open(target) as store:
        filled(store)
        before = asked(store, "SELECT count(*) FROM attribute_log")
        for given, whose, said in NONSENSE:
            with pytest.raises(UsageError) as raised:
                set_attribute(store, *given, cast(AttributeOwner, {"variant": "A", **whose}), text=False)
            answers.append(str(raised.value))
            assert said in answers[-1]
    assert main(["set", PART, "density", "2,7", "--unit", KG, "--arc", "0", "--variant", "A", "--store", target]) == 2
    answer = capsys.readouterr().err
    assert answer.count("\n") == 1
    answers.append(answer.partition(": ")[2].rstrip("\n"))
    assert asked(target, "SELECT count(*) FROM attribute_log") == before
    runs = asked(target, "SELECT state, message FROM run_summary WHERE kind = 'set' ORDER BY run_id")
    assert [(state, visible(message)) for state, message in runs] == [("failed", visible(said)) for said in answers]
