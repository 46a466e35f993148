"""One model exported again: other entity order, other numbers in the last digits, other settings of the writer."""

from __future__ import annotations

import re
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from OCP.Interface import Interface_Static

from relmodel.store import Store
from tests.loading.test_load import row_counts
from tests.loading.test_snap import jittered
from tests.parts.solids import box, cylinder
from tests.parts.step_parts import write_solids
from tests.parts.turned_parts import workshop
from tests.reading import load
from tests.variants.composed import differences

ENTITY = re.compile(r"(?ms)^#(\d+)\s*=\s*(.*?);\s*$")


def shuffled(text: str, rng: np.random.Generator) -> str:
    """Every entity under another number and at another place."""
    head, data, tail = re.split(r"(?m)(?<=^DATA;\n)|(?=^ENDSEC;\nEND-ISO)", text)
    entities = ENTITY.findall(data)
    places = rng.permutation(len(entities)).tolist()
    number = {old: str(7 + new) for (old, _), new in zip(entities, places, strict=True)}
    renumber = re.compile(r"#(\d+)")
    lines = [f"#{number[n]}={renumber.sub(lambda m: '#' + number[m.group(1)], body)};" for n, body in entities]
    rng.shuffle(lines)
    return head + "\n".join(lines) + "\n" + tail


def exported(path: Path, bodies: Sequence[Any], **settings: int) -> str:
    """Bodies as the writer writes them, each product under the number of its body."""
    before = {key: Interface_Static.IVal_s(key) for key in settings}
    for key, value in settings.items():
        assert Interface_Static.SetIVal_s(key, value)
    text = write_solids(path, *bodies).read_text()
    for key, value in before.items():
        Interface_Static.SetIVal_s(key, value)
    names = list(dict.fromkeys(re.findall(r"'Open CASCADE STEP translator [^']*'", text)))
    return re.sub(r"'Open CASCADE STEP translator [^']*'", lambda m: f"'BODY {names.index(m[0])}'", text)


def test_an_export_with_other_numbers_order_and_settings_differs_in_nothing(store: Store, tmp_path: Path) -> None:
    bodies = workshop(2).body, box((200, 0, 0), (260, 40, 8)), cylinder((0, 300, 0), 9, 40)
    plain: dict[str, Any] = {"write.surfacecurve.mode": 1, "write.step.schema": 1}
    other: dict[str, Any] = {"write.surfacecurve.mode": 0, "write.step.schema": 5}
    text, again = (exported(tmp_path / "any.step", bodies, **given) for given in (plain, other))
    rng = np.random.default_rng(5)
    paths = [tmp_path / name / "bodies.step" for name in "AB"]
    for path, content in zip(paths, (text, shuffled(jittered(again, rng), rng)), strict=True):
        path.parent.mkdir()
        path.write_text(content)
    first, second = (load(store, path, name="bodies", variant=path.parent.name) for path in paths)
    # The same geometry: no row of it is new; what it is placed in comes in another order.
    assert (second.shapes_added, second.surfaces_added, second.arcs_added) == (0, 0, 0)
    assert second.object_id != first.object_id
    rows = differences(store, "A", "B", "bodies")
    assert {(r["status"], r["differs"]) for r in rows} == {("identical", None)}
    counts = row_counts(store)
    assert load(store, paths[1], name="bodies", variant="B").status == "unchanged"
    assert row_counts(store) == counts
