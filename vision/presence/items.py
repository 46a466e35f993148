"""What is assessed: the parts, features and surfaces in view, and which surfaces make each."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats, Ints
from relmodel.store import Store
from vision.cameras.cameras import Rig
from vision.localisation.coverage import count_visible
from vision.localisation.parameters import LocalisationParameters
from vision.localisation.parts_in_view import PART, PartsInView
from vision.localisation.stored_scene import StoredScene

NONE = -1  # number of the feature or surface of an item that is neither


@dataclass(frozen=True)
class Items:
    """Parts and features, as `PartsInView` has them, then surfaces, as columns.

    level: part, feature or surface; occurrence: the scene's; feature_no, surface_no: in the part's shape, NONE where the
    item is neither; path; kind: of a feature, else empty; visible_px: by all cameras; thickness: mm, nan where it has none.
    member, surface: pairs of item and the scene's surface that belongs to it.  radius: of the scene's surfaces (s,), mm,
    nan where it is no cylinder.
    """

    level: list[str]
    occurrence: Ints
    feature_no: Ints
    surface_no: Ints
    path: list[str]
    kind: list[str]
    visible_px: Floats
    thickness: Floats
    member: Ints
    surface: Ints
    radius: Floats

    def __len__(self) -> int:
        return len(self.path)


def list_items(
    store: Store,
    connection: Connection,
    stored: StoredScene,
    rig: Rig,
    world_from_rig: Floats,
    parts: PartsInView,
    p: LocalisationParameters,
) -> Items:
    """All that is in view of inspected objects at a pose."""
    scene = stored.scene
    shapes = [int(s) for s in np.unique(stored.shape_id)]
    rows = store.columns(connection, "presence_features", shape_ids=shapes)
    cylinders = store.columns(connection, "presence_surfaces", shape_ids=shapes)
    occurrence = np.searchsorted(stored.occurrence_id, parts.occurrence_id)
    kept = np.flatnonzero(scene.inspected[occurrence])
    occurrence, feature_no = occurrence[kept], parts.feature_no[kept]
    shape_of_surface = stored.shape_id[scene.surface_occurrence]

    visible = sum(
        count_visible(scene, camera, world_from_rig @ rig.rig_from_camera[name], p)
        for name, camera in rig.cameras.items()
    )
    seen = np.flatnonzero((visible > 0) & scene.inspected[scene.surface_occurrence])
    kind, thickness = [""] * len(kept), np.full(len(kept), np.nan)
    member, surface = [len(kept) + np.arange(len(seen))], [seen]
    by_surface = {
        (o, n): s
        for s, (o, n) in enumerate(zip(scene.surface_occurrence.tolist(), stored.surface_no.tolist(), strict=True))
    }
    named: dict[tuple[int, int], slice] = {}
    keys = np.stack([rows["shape_id"], rows["feature_no"]], axis=1).astype(np.int64).reshape(-1, 2)
    heads = np.flatnonzero(np.append(True, (np.diff(keys, axis=0) != 0).any(axis=1))[: len(keys)])
    for at, end in zip(heads, np.append(heads[1:], len(keys)), strict=True):
        named[int(keys[at, 0]), int(keys[at, 1])] = slice(int(at), int(end))
    for number, (o, f) in enumerate(zip(occurrence.tolist(), feature_no.tolist(), strict=True)):
        if f == PART:
            mine = np.flatnonzero(scene.surface_occurrence == o)
        else:
            those = named[int(stored.shape_id[o]), f]
            mine = np.array([by_surface[o, int(n)] for n in rows["surface_no"][those]], np.int64)
            kind[number] = str(rows["kind"][those][0])
            value = rows["thickness"][those][0]
            thickness[number] = np.nan if value is None else float(value)
        member.append(np.full(len(mine), number))
        surface.append(mine)
    paths = [parts.path[k] for k in kept]
    paths += [f"{stored.paths[o]}/face {n}" for o, n in zip(scene.surface_occurrence[seen], stored.surface_no[seen], strict=True)]

    radius = np.full(len(stored.surface_no), np.nan)
    of = {
        (int(s), int(n)): float(r)
        for s, n, r in zip(cylinders["shape_id"], cylinders["surface_no"], cylinders["radius"], strict=True)
    }
    for k in np.unique(seen).tolist():
        radius[k] = of.get((int(shape_of_surface[k]), int(stored.surface_no[k])), np.nan)
    none = np.full(len(seen), NONE)
    return Items(
        level=["part" if f == PART else "feature" for f in feature_no] + ["surface"] * len(seen),
        occurrence=np.concatenate([occurrence, scene.surface_occurrence[seen]]),
        feature_no=np.concatenate([np.where(feature_no == PART, NONE, feature_no), none]),
        surface_no=np.concatenate([np.full(len(kept), NONE), stored.surface_no[seen]]),
        path=paths,
        kind=kind + [""] * len(seen),
        visible_px=np.concatenate([parts.visible[kept], visible[seen]]),
        thickness=np.concatenate([thickness, np.full(len(seen), np.nan)]),
        member=np.concatenate(member),
        surface=np.concatenate(surface),
        radius=radius,
    )
