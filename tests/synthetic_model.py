"""A store filled with random shapes, parts and nested assemblies by appending rows, for tests that load no files."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt
import sqlalchemy as sa
import yaml

from relmodel.geometry.transforms import matrix_columns, rotation_matrix
from relmodel.loading.write import append_expansion
from relmodel.store import Store
from relmodel.world.placement import WorldReport, place_world

BOX = ("x0", "y0", "z0", "x1", "y1", "z1")
LEVELS = ("feature", "surface", "arc")


@dataclass
class Node:
    """An assembly: its children are (name, parent_from_child, shape number or assembly)."""

    name: str
    children: list[tuple[str, npt.NDArray[np.float64], int | Node]] = field(default_factory=list)


@dataclass
class Placed:
    """A part as the oracle places it."""

    path: str
    world_from_part: npt.NDArray[np.float64]
    shape: int


class SyntheticModel:
    """Random shapes with boxes of elements inside, and a tree of assemblies of them; `fill` writes it to a store."""

    def __init__(
        self, seed: int, *, shapes: int = 5, elements: int = 30, groups: int = 4, parts: int = 6, longer: float = 1.0
    ) -> None:
        """longer: how many times as long as drawn each shape is along one axis, the next shape along the next."""
        self.rng = np.random.default_rng(seed)
        self.shape_boxes = np.empty((shapes, 6))
        self.elements: list[dict[str, npt.NDArray[np.float64]]] = []
        for shape in range(shapes):
            half = self.rng.uniform(2, 20, 3)
            half[shape % 3] *= longer
            self.shape_boxes[shape] = [*-half, *half]
            boxes = {}
            for level in LEVELS:
                ends = np.sort(self.rng.uniform(-half, half, (elements, 2, 3)), axis=1)
                ends[::5, 1, 2] = ends[::5, 0, 2]  # every fifth has no thickness
                boxes[level] = ends.reshape(elements, 6)
            self.elements.append(boxes)
        bolt = Node("bolt", [(f"item {i}", self.transform(15), int(self.rng.integers(shapes))) for i in range(3)])
        self.root = Node("cell part")
        for group in range(groups):
            node = Node(f"group {group}", [("bolt", self.transform(60), bolt), ("bolt", self.transform(60), bolt)])
            node.children += [(f"part/{i}", self.transform(80), int(self.rng.integers(shapes))) for i in range(parts)]
            self.root.children.append((node.name, self.transform(250), node))

    def transform(self, spread: float) -> npt.NDArray[np.float64]:
        """A random rigid transform; one in three turns by quarters, so that boxes touch."""
        out = np.eye(4)
        if self.rng.random() < 1 / 3:
            out[:3, :3] = np.round(rotation_matrix(np.eye(3)[self.rng.integers(3)] * np.pi / 2 * self.rng.integers(4)))
        else:
            out[:3, :3] = rotation_matrix(self.rng.uniform(-2, 2, 3))
        out[:3, 3] = np.round(self.rng.uniform(-spread, spread, 3))
        return out

    def fill(self, store: Store, name: str = "thing", revision: int = 1, variant: str = "") -> None:
        """Write the model as the loaded object `name`."""
        tag = f"{name}/{variant}/{revision}"
        with store.write() as connection:

            def put(table: str, **columns: Any) -> None:
                store.append(connection, table, columns)

            shape_ids = store.new_ids(connection, "shape", len(self.shape_boxes))
            keys = [f"{tag}/shape {i}" for i in range(len(shape_ids))]
            counts = {f"{level}_count": [len(boxes[level]) for boxes in self.elements] for level in ("surface", "arc")}
            put("shape", id=shape_ids, content_key=keys, kind="solid", area=1.0, **counts, **boxed(self.shape_boxes))
            feature_class = store.new_ids(connection, "feature_class", 1)
            put("feature_class", id=feature_class, content_key=[f"{tag}/class"], kind=["pocket"])
            for level in ("surface", "arc"):
                _append_listed(store, connection, shape_ids, level, tag, np.stack([b[level] for b in self.elements]))
            b = np.concatenate([boxes["feature"] for boxes in self.elements])
            number = np.tile(np.arange(len(self.elements[0]["feature"])), len(shape_ids))
            named: dict[str, Any] = {"feature_no": number, "name": [f"pocket {i}" for i in number]}
            named["shape_id"] = np.repeat(shape_ids, len(b) // len(shape_ids))
            named["feature_class_id"] = int(feature_class[0])
            put("feature", **named, **matrix_columns(np.broadcast_to(np.eye(4), (len(b), 4, 4))), **boxed(b))
            part_ids = store.new_ids(connection, "part", len(shape_ids))
            names = [f"P{i}" for i in range(len(part_ids))]
            keys = [f"{tag}/part {i}" for i in range(len(part_ids))]
            put("part", id=part_ids, content_key=keys, number=names, name=names, shape_id=shape_ids)
            nodes = [self.root]  # every assembly once
            for node in nodes:
                within = {id(it): it for _, _, it in node.children if isinstance(it, Node)}
                nodes += [it for key, it in within.items() if key not in map(id, nodes)]
            ids = dict(zip(map(id, nodes), store.new_ids(connection, "object", len(nodes)).tolist(), strict=True))
            object_id, names = ids[id(self.root)], [node.name for node in nodes]
            keys = [f"{tag}/{name}" for name in names]
            put("object", id=[*ids.values()], content_key=keys, name=names, kind="assembly")
            tables = ("object_object", "parent_id", "child_id"), ("object_part", "object_id", "part_id")
            for table, parent, child in tables:
                rows = [
                    (ids[id(n)], i, of, pose, ids[id(it)] if isinstance(it, Node) else int(part_ids[it]))
                    for n in nodes
                    for i, (of, pose, it) in enumerate(n.children)
                    if isinstance(it, Node) == (table == "object_object")
                ]
                if rows:
                    parents, numbers, called, poses, held = map(list, zip(*rows, strict=True))
                    columns = {parent: parents, child: held, "child_no": numbers, "name": called}
                    put(table, **columns, **matrix_columns(np.stack(poses)))
            source_id = store.new_ids(connection, "source", 1)
            file = {"file_name": [f"{name}.step"], "sha256": [tag], "format": ["step"], "loader_version": ["1"]}
            put("source", id=source_id, unit=["mm"], unit_mm=[1.0], **file)
            variant_id = store.new_ids(connection, "object_variant", 1)
            given = {"name": [name], "variant": [variant], "revision": [revision]}
            put("object_variant", id=variant_id, object_id=[object_id], source_id=source_id, **given)
            append_expansion(store, connection, object_id)

    def placed(self, name: str, world_from_object: npt.NDArray[np.float64]) -> list[Placed]:
        """All parts of the object placed under `name`, walked with NumPy: the oracle of the expansion."""
        out: list[Placed] = []

        def walk(node: Node, path: str, world_from_node: npt.NDArray[np.float64]) -> None:
            names = [child[0].replace("/", "_") for child in node.children]
            for number, (_, node_from_child, child) in enumerate(node.children):
                unique = names[number] if names.count(names[number]) == 1 else f"{names[number]}#{number}"
                world_from_child = world_from_node @ node_from_child
                if isinstance(child, Node):
                    walk(child, f"{path}/{unique}", world_from_child)
                else:
                    out.append(Placed(f"{path}/{unique}", world_from_child, child))

        walk(self.root, name, world_from_object)
        return out


def boxed(boxes: npt.NDArray[np.float64]) -> dict[str, npt.NDArray[np.float64]]:
    """Columns of boxes (n, 6)."""
    return dict(zip(BOX, boxes.T, strict=True))


def _append_listed(
    store: Store, connection: sa.Connection, shape_ids: Any, level: str, tag: str, boxes: npt.NDArray[np.float64]
) -> None:
    """Surfaces or arcs (shapes, n, 6) of shapes, of which only the boxes matter."""
    shapes, count = boxes.shape[:2]
    boxes = boxes.reshape(-1, 6)
    ids = store.new_ids(connection, level, len(boxes))
    keys = [f"{tag}/{shape}/{level} {number}" for shape in range(shapes) for number in range(count)]
    places = ("centroid",) if level == "surface" else ("start", "end")
    columns: dict[str, Any] = {"id": ids, "content_key": keys, "provenance": "exact", **boxed(boxes)}
    columns |= dict.fromkeys(("kind", "recognised_kind"), "spline")
    columns |= {f"{place}_{axis}": boxes[:, i] for place in places for i, axis in enumerate("xyz")}
    if level == "surface":
        columns |= {"support_key": keys, "direct": True, "reversed": False, "area": 1.0}
        columns |= {"u0": 0.0, "u1": 1.0, "v0": 0.0, "v1": 1.0}
    else:
        columns |= {"t0": 0.0, "t1": 1.0, "length": 1.0}
    store.append(connection, level, columns)
    listed: dict[str, Any] = {"shape_id": np.repeat(shape_ids, count), f"{level}_no": np.tile(np.arange(count), shapes)}
    listed |= {f"{level}_id": ids}
    store.append(connection, f"shape_{level}", listed | ({"convexity": "free"} if level == "arc" else {}))


def place_things(
    store: Store, folder: Path, places: Mapping[str, npt.NDArray[np.float64]], what: str = "thing"
) -> WorldReport:
    """The world `cell` of one object at some places, by name."""
    objects: list[dict[str, object]] = [
        {"object": what, "name": name, "world_from_object": place.tolist()} for name, place in places.items()
    ]
    return place_world(store, write_world(folder / "world.yaml", "cell", objects))


def write_world(path: Path, world: str, objects: list[dict[str, object]]) -> Path:
    """A world file."""
    path.write_text(yaml.safe_dump({"world": world, "objects": objects}))
    return path
