"""Objects of parts that the CAD kernel composes, stored without a file between."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa

from relmodel.loading.write import LoadReport
from relmodel.model.model import Assembly, Instance, Model, Part
from relmodel.readers.step import shape as step_shape
from relmodel.store import Store
from relmodel.variants.compare import compare
from tests.poses import pose_of
from tests.reading import store_model

Pose = npt.NDArray[np.float64]
pose = pose_of


@dataclass(frozen=True)
class Item:
    """A body placed under a name."""

    name: str
    body: Any
    pose: Pose
    number: str = "P-1"
    material: str | None = None


def store_items(store: Store, variant: str, items: Sequence[Item], name: str = "thing") -> LoadReport:
    """Store an object of these items."""
    bodies = {id(item.body): item.body for item in items}
    shapes = tuple(step_shape.extract(body) for body in bodies.values())
    shape_of = {key: number for number, key in enumerate(bodies)}
    parts = tuple(Part(item.number, item.number, shape_of[id(item.body)], item.material) for item in items)
    placed = tuple(Instance(item.name, "part", i, item.pose) for i, item in enumerate(items))
    model = Model("STEP", "mm", 1.0, shapes, parts, (Assembly(name, placed),), 0, 0, "test", "AP242")
    return store_model(store, model, name, variant)


def differences(store: Store, before: str, after: str, name: str = "thing") -> list[dict[str, Any]]:
    """Rows of `variant_change` between two variants."""
    comparison = compare(store, (name, before), (name, after))
    view = sa.text(
        "SELECT * FROM variant_change WHERE comparison_id = :id ORDER BY level, element_a, element_b, object_path_b"
    )
    with store.read() as connection:
        return [dict(r._mapping) for r in connection.execute(view, {"id": comparison.id})]
