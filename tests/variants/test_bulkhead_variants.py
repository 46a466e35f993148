"""The demonstration's further variants: what each adds to a store, and how it differs from its base."""

from __future__ import annotations

import gzip
import json
from collections import Counter
from pathlib import Path
from typing import Any

import pytest
import sqlalchemy as sa

from examples.bulkhead.design import BASES, VARIANTS
from examples.bulkhead.features import all_features, changes
from relmodel.loading.load import load
from relmodel.loading.write import LoadReport
from relmodel.store import Store
from relmodel.variants.compare import compare
from tests.loading.test_load import row_counts

EXAMPLES = Path(__file__).parents[2] / "examples"


def step_file(variant: str) -> Path:
    folder = "demo" if variant in "AB" else "bulkhead/variants"
    return EXAMPLES / folder / f"bulkhead_{variant}.step.gz"


def golden(name: str) -> Any:
    return json.loads((EXAMPLES / f"bulkhead/golden/{name}.json").read_text())


@pytest.mark.parametrize("variant", sorted(BASES))
def test_the_history_is_that_of_the_design(variant: str) -> None:
    """The committed table and history are what the design says; the STEP file has as many faces as the table."""
    base = BASES[variant]
    tables = {v: [json.loads(json.dumps(f.row())) for f in all_features(VARIANTS[v]())] for v in (base, variant)}
    assert tables[variant] == golden(f"bulkhead_{variant}")["features"]
    history = json.loads(json.dumps(changes(tables[base], tables[variant])))
    assert history == golden(f"changes_{base}_to_{variant}")
    faces = sum(p["faces"] for p in golden(f"bulkhead_{variant}")["parts"].values())
    assert gzip.decompress(step_file(variant).read_bytes()).count(b"ADVANCED_FACE(") == faces


@pytest.fixture(scope="module")
def store(tmp_path_factory: pytest.TempPathFactory) -> Any:
    with Store.create(tmp_path_factory.mktemp("variants") / "s.duckdb") as opened:
        yield opened


def take(store: Store, variant: str) -> LoadReport:
    return load(store, step_file(variant), name="bulkhead", variant=variant)


def test_a_variant_adds_what_changed_and_a_reload_nothing(store: Store) -> None:
    first, second = take(store, "A"), take(store, "D")
    assert (first.shapes_added, second.shapes_added) == (4, 1)
    # D is A with more bolts: of surfaces two a bolt hole are new (wall and bottom), and the flange that they pierce.
    holes = len(golden("changes_A_to_D"))
    assert holes == 88
    assert second.surfaces_added == 2 * holes + 1
    assert second.arcs_added == 3 * holes  # mouth, seam, bottom edge
    counts = row_counts(store)
    again = take(store, "D")
    assert (again.status, again.surfaces_added, again.arcs_added) == ("unchanged", 0, 0)
    assert row_counts(store) == counts

    found = compare(store, ("bulkhead", "A"), ("bulkhead", "D"))
    surfaces = {s: n for (level, s), n in found.counts.items() if level == "surface"}
    assert surfaces == {"identical": first.faces_loaded - 33 - 1, "retrimmed": 1, "added": 2 * holes}
    query = sa.text("SELECT status, kind FROM variant_change WHERE comparison_id = :id AND level = 'feature'")
    with store.read() as connection:
        features = Counter((r.status, r.kind) for r in connection.execute(query, {"id": found.id}))
    assert features["added", "blind_hole"] == holes
    milled = {status for status, kind in features if kind in ("through_hole", "pocket", "lug", "boss", "rib", "web")}
    assert milled == {"identical"}
    parts = {s: n for (level, s), n in found.counts.items() if level == "part"}
    assert parts == {"identical": 53, "changed": 1, "added": holes}


def test_a_thinned_variant_changes_pockets_and_keeps_the_outside(store: Store) -> None:
    take(store, "F")
    found = compare(store, ("bulkhead", "A"), ("bulkhead", "F"))
    kinds = Counter(c["kind"] for c in golden("changes_A_to_F"))
    fronts = [c for c in golden("changes_A_to_F") if c["kind"] == "pocket" and c["name"].endswith("front")]
    assert kinds["pocket"] > len(fronts) > 20
    # A front floor that has come down is a plane that moved, or one of another outline elsewhere: never the same.
    assert found.counts["surface", "moved"] >= len(fronts)
    assert found.counts["feature", "changed"] >= len(fronts)
    assert ("feature", "removed") not in found.counts
