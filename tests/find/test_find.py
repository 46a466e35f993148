"""What lies in a volume: in process and in SQL, against brute force over the corners of every box."""

from __future__ import annotations

from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt
import pytest
import sqlalchemy as sa

from relmodel.errors import UsageError
from relmodel.find.find import LEVELS, in_volume, in_volumes
from relmodel.find.indexes import KINDS, WorldIndex
from relmodel.find.volumes import Box, Frustum, OrientedBox, Polyhedron, Sphere, Volume, widened
from relmodel.store import Store
from relmodel.world import place_world
from tests.given import CopyStore
from tests.poses import pose_of
from tests.synthetic_model import BOX, SyntheticModel, place_things, write_world

if TYPE_CHECKING:
    from tests.find.conftest import Filled


Answer = set[tuple[str, int]]


class Oracle:
    """Corners in the world (n, 8, 3) of every part and element, from the walk of the synthetic model."""

    def __init__(self, model: SyntheticModel, places: dict[str, npt.NDArray[np.float64]]) -> None:
        self.key: dict[str, list[tuple[str, int]]] = {level: [] for level in LEVELS}
        corners: dict[str, list[Any]] = {level: [] for level in LEVELS}
        for name, transform in places.items():
            for placed in model.placed(name, transform):
                boxes = {"part": model.shape_boxes[[placed.shape]], **model.elements[placed.shape]}
                for level, b in boxes.items():
                    self.key[level] += [(placed.path, -1 if level == "part" else i) for i in range(len(b))]
                    local = np.stack([b[:, [i, j, k]] for i in (0, 3) for j in (1, 4) for k in (2, 5)], axis=1)
                    corners[level].append(local @ placed.world_from_part[:3, :3].T + placed.world_from_part[:3, 3])
        self.corners = {level: np.concatenate(c) for level, c in corners.items()}
        self.low = {level: c.min(axis=1) for level, c in self.corners.items()}
        self.high = {level: c.max(axis=1) for level, c in self.corners.items()}

    def in_box(self, box: Box, level: str) -> Answer:
        met = (self.low[level] <= box.bounds[3:]) & (self.high[level] >= box.bounds[:3])
        return self._keys(level, np.asarray(met.all(axis=1)))

    def in_view(self, view: Frustum, level: str) -> Answer:
        """Not all corners beyond one side of the picture, one depth, or one face of the frustum's bounding box."""
        corners = self.corners[level]
        camera = (corners - view.world_from_camera[:3, 3]) @ view.world_from_camera[:3, :3]
        u, v, z = np.moveaxis(camera @ view.matrix.T, 2, 0)
        beyond = [u < -0.5 * z, u > (view.width - 0.5) * z, v < -0.5 * z, v > (view.height - 0.5) * z]
        beyond += [z < view.near, z > view.far]
        beyond += [corners[..., i] < view.bounds[i] for i in range(3)]
        beyond += [corners[..., i] > view.bounds[3 + i] for i in range(3)]
        wholly = np.asarray([b.all(axis=1) for b in beyond])
        return self._keys(level, np.asarray(~wholly.any(axis=0)))

    def in_solid(self, volume: OrientedBox | Sphere | Polyhedron, level: str) -> Answer:
        """Not beyond the ball (by more than rounding), nor all corners beyond a face of it or of its bounds."""
        corners = self.corners[level]
        met = (self.low[level] <= volume.bounds[3:]) & (self.high[level] >= volume.bounds[:3])
        met = np.asarray(met).all(axis=1)
        if isinstance(volume, Sphere):
            centre = np.array([volume.x, volume.y, volume.z]) - corners[:, 0]
            nearest = corners[:, 0].copy()
            for edge in (corners[:, 4] - corners[:, 0], corners[:, 2] - corners[:, 0], corners[:, 1] - corners[:, 0]):
                length2 = np.maximum((edge**2).sum(axis=1), 1e-300)
                nearest += edge * np.clip((edge * centre).sum(axis=1) / length2, 0, 1)[:, None]
            met &= np.linalg.norm(nearest - corners[:, 0] - centre, axis=1) <= volume.radius + 1e-9
        elif isinstance(volume, OrientedBox):
            local = (corners - volume.world_from_box[:3, 3]) @ volume.world_from_box[:3, :3]
            beyond: Any = np.concatenate([local > volume.half, local < -volume.half], axis=2)
            met &= ~beyond.all(axis=1).any(axis=1)
        else:
            given = np.asarray(volume.given)
            beyond = np.asarray(corners @ given[:, :3].T > given[:, 3])
            met &= ~beyond.all(axis=1).any(axis=1)
        return self._keys(level, met)

    def _limits(self, level: str) -> npt.NDArray[np.float64]:
        """Corners (4, n, 3): the lowest and the highest of each element's box, then of its part's."""
        of_part = {path: i for i, (path, _) in enumerate(self.key["part"])}
        own = [of_part[path] for path, _ in self.key[level]]
        return np.stack([self.low[level], self.high[level], self.low["part"][own], self.high["part"][own]])

    def away(self, level: str, at: npt.NDArray[np.float64]) -> npt.NDArray[np.float64]:
        """How far (n,) each is from a point: as the farther of its box and its part's, on each axis."""
        low, high, part_low, part_high = self._limits(level)
        beyond = np.maximum.reduce([low - at, at - high, part_low - at, at - part_high, 0 * low])
        return np.asarray(np.linalg.norm(beyond, axis=1))

    def within_box(self, level: str, bounds: npt.NDArray[np.float64]) -> Answer:
        """What lies wholly within, and whose part meets it."""
        low, high, part_low, part_high = self._limits(level)
        inside = (low >= bounds[:3]).all(axis=1) & (high <= bounds[3:]).all(axis=1)
        return self._keys(level, inside & ((part_low <= bounds[3:]) & (part_high >= bounds[:3])).all(axis=1))

    def _keys(self, level: str, chosen: npt.NDArray[np.bool_]) -> Answer:
        return {self.key[level][i] for i in np.flatnonzero(chosen)}


PLACES = {"a": np.eye(4), "b": pose_of([300, -150, 80], [0.4, -1.1, 0.7])}


def fill(store: Store, folder: Path, seed: int = 7) -> Oracle:
    model = SyntheticModel(seed)
    model.fill(store)
    place_things(store, folder, PLACES)
    return Oracle(model, PLACES)


@pytest.fixture
def store(filled: Filled) -> Iterator[Store]:
    with Store.open(filled.target) as opened:
        yield opened


def random_boxes(oracle: Oracle, count: int, seed: int) -> list[Box]:
    """Around placed arcs, from points to most of the world, one in ten without thickness in an axis."""
    rng = np.random.default_rng(seed)
    centre = rng.choice(oracle.low["arc"], count) + rng.normal(0, 10, (count, 3))
    half = 10 ** rng.uniform(-1, 2.5, (count, 3))
    half[np.arange(0, count, 10), rng.integers(3, size=len(range(0, count, 10)))] = 0
    return [Box(*c) for c in np.concatenate([centre - half, centre + half], axis=1)]


def random_views(count: int, seed: int) -> list[Frustum]:
    rng = np.random.default_rng(seed)
    matrix = np.array([[700.0, 150, 380.0], [0, 950, 210.0], [0, 0, 1]])
    views = []
    for _ in range(count):
        pose = pose_of(turn=rng.uniform(-3, 3, 3), shift=rng.uniform(-500, 700, 3))
        near = rng.uniform(0, 200)
        views.append(Frustum(640, 480, matrix, pose, near, near + rng.uniform(10, 800)))
    return views


def random_solids(oracle: Oracle, count: int, seed: int) -> list[OrientedBox | Sphere | Polyhedron]:
    """Turned boxes, one in ten without thickness, balls, one in ten a point, and tetrahedra, around placed arcs."""
    rng = np.random.default_rng(seed)
    volumes: list[OrientedBox | Sphere | Polyhedron] = []
    for number, point in enumerate(rng.choice(oracle.low["arc"], count) + rng.normal(0, 1, (count, 3))):
        size = 10 ** rng.uniform(-1, 2.3)
        kind = number % 3
        if kind == 0:
            pose = pose_of(point, rng.uniform(-2, 2, 3))
            half = size * rng.uniform(0.2, 1, 3)
            half[2] *= number % 10 > 0
            volumes.append(OrientedBox(pose, half))
        elif kind == 1:
            x, y, z = point.tolist()
            volumes.append(Sphere(x, y, z, size if number % 10 else 0.0))
        else:
            tip = point + size * np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]]) * rng.uniform(0.5, 1, 3)
            planes = []
            for i in range(4):
                a, b, c = np.delete(tip, i, axis=0)
                normal = np.cross(b - a, c - a)
                normal *= -np.sign(normal @ (tip[i] - a))
                planes.append([*normal, normal @ a])
            volumes.append(Polyhedron(planes))
    return volumes


def paths(store: Store) -> dict[int, str]:
    with store.read() as connection:
        return {row.id: row.path for row in connection.execute(sa.text("SELECT id, path FROM occurrence"))}


def answer(found: dict[str, npt.NDArray[Any]]) -> Answer:
    return set(zip(found["path"].tolist(), found["element_no"].tolist(), strict=True))


@cache
def questions() -> tuple[list[Any], list[Box], list[Frustum]]:
    """Solids, boxes and views of the world that the stores are filled with."""
    oracle = Oracle(SyntheticModel(7), PLACES)
    covariance = np.diag(np.repeat([4.0, 0.02], 3) ** 2)
    wide = [widened(view, covariance, 0.99) for view in random_views(5, 11)]
    return [*random_solids(oracle, 45, 8), *wide], random_boxes(oracle, 20, 9), random_views(8, 10)


def test_every_volume_by_every_kind(store: Store, filled: Filled) -> None:
    """In process and in SQL, one by one and as a table of volumes of all kinds."""
    oracle, path = filled.oracle, paths(store)
    solids, boxes, views = questions()
    volumes: list[Volume] = [*solids, *boxes, *views]
    kinds = KINDS if store.dialect == "duckdb" else KINDS[:1]  # what was read is alike
    indexes = [WorldIndex.load(store, kind=kind) for kind in kinds]
    for level in LEVELS:
        expected = [oracle.in_solid(volume, level) for volume in solids]
        expected += [oracle.in_box(box, level) for box in boxes] + [oracle.in_view(view, level) for view in views]
        assert sum(bool(e) for e in expected) > 45
        found = in_volumes(store, volumes, level=level)
        number, ids, elements = (found[name] for name in ("volume_no", "occurrence_id", "element_no"))
        for i in range(len(volumes)):
            here = number == i
            assert {(path[o], e) for o, e in zip(ids[here], elements[here], strict=True)} == expected[i]
        assert answer(in_volume(store, volumes[1], level=level)) == expected[1]
        for index in indexes:
            answered = index.in_volumes(volumes, level)
            assert all(map(np.array_equal, answered, (number, ids, elements))), index.kind
        assert len(indexes[0].in_volumes([], level)[0]) == len(in_volumes(store, [], level=level)["path"]) == 0


def test_a_store_without_a_world(duckdb_file: Path) -> None:
    with Store.open(duckdb_file) as store:
        assert len(in_volume(store, Box(0, 0, 0, 1, 1, 1))["path"]) == 0
        assert len(WorldIndex.load(store).in_volume(Box(0, 0, 0, 1, 1, 1), "arc")[0]) == 0
        with pytest.raises(UsageError, match="holds none"):
            in_volume(store, Box(0, 0, 0, 1, 1, 1), world="cell")


@pytest.mark.parametrize("filled", ["duckdb"], indirect=True)
def test_the_whole_world(store: Store, filled: Filled) -> None:
    key = filled.oracle.key
    big = Box(-2000, -2000, -2000, 2000, 2000, 2000)
    assert len(WorldIndex.load(store).in_volume(big, "feature")[0]) == len(key["feature"])
    with store.read() as connection:  # as any client asks
        count = "SELECT count(*) FROM {}_in_box(-2e3, -2e3, -2e3, 2e3, 2e3, 2e3)"
        for level in LEVELS:
            assert connection.exec_driver_sql(count.format(level + "s")).scalar() == len(key[level])
        named = "SELECT count(*) FROM parts_in_box(-2e3, -2e3, -2e3, 2e3, 2e3, 2e3, '{}')"
        assert connection.exec_driver_sql(named.format("cell")).scalar() == len(key["part"])
        assert connection.exec_driver_sql(named.format("other")).scalar() == 0


@pytest.mark.parametrize("filled", ["duckdb"], indirect=True)  # what was read is alike
def test_touching_counts(store: Store) -> None:
    """A face that just reaches a box's face is in it; one step of floating point further it is not."""
    index = WorldIndex.load(store)
    for level in LEVELS:
        found = in_volume(store, Box(-2000, -2000, -2000, 2000, 2000, 2000), level=level)
        box = np.array([found[name][1] for name in BOX], float)
        key = found["occurrence_id"][1], found["element_no"][1]
        volumes = []
        for side in range(6):
            for at in (box[side], np.nextafter(box[side], np.inf if side > 2 else -np.inf)):
                bounds = box.copy()
                bounds[[side % 3, side % 3 + 3]] = at
                volumes.append(Box(*bounds))
        number, *keys = index.in_volumes(volumes, level)
        asked = in_volumes(store, volumes, level=level)
        of_store = (asked[name] for name in ("volume_no", "occurrence_id", "element_no"))
        for numbers, ids, elements in ((number, *keys), of_store):
            assert numbers[(ids == key[0]) & (elements == key[1])].tolist() == [0, 2, 4, 6, 8, 10]


@pytest.mark.parametrize("filled", ["duckdb"], indirect=True)  # what was read is alike
def test_worlds_by_name(filled: Filled, copy_store: CopyStore, tmp_path: Path) -> None:
    with Store.open(copy_store(filled.target)) as store:
        place_world(store, write_world(tmp_path / "other.yaml", "other", [{"object": "thing"}]))
        place_world(store, write_world(tmp_path / "other.yaml", "other", [{"object": "thing", "role": "tool"}]))
        everything = Box(-2000, -2000, -2000, 2000, 2000, 2000)
        with pytest.raises(UsageError, match="several worlds: name one of cell, other"):
            in_volume(store, everything)
        with pytest.raises(UsageError, match="no world 'third'"):
            in_volume(store, everything, world="third")
        with pytest.raises(UsageError, match="no level 'edge'"):
            in_volume(store, everything, level="edge", world="cell")
        with pytest.raises(UsageError, match="no precision 'fine'"):
            in_volume(store, everything, world="cell", precision="fine")
        both = {w: len(in_volume(store, everything, world=w)["path"]) for w in ("cell", "other")}
        assert both["cell"] == 2 * both["other"] > 0  # the newest revision only
