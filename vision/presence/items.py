"""What is assessed: the parts, features and surfaces in view, and which surfaces make each."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.localisation.coverage import SurfaceMap
from vision.localisation.parts_in_view import PART, PartsInView
from vision.scene.stored_scene import StoredScene

INSETS = ("through_hole", "blind_hole", "boss", "duct")
NONE = -1  # number of the feature or surface of an item that is neither


@dataclass(frozen=True)
class Items:
    """Parts and features, as `PartsInView` has them, then surfaces, as columns.

    level: part, feature or surface; occurrence: the scene's; feature_no, surface_no: in the part's shape, NONE where
    the item is neither; path; kind: of a feature, else empty; visible_px: by all cameras; thickness: mm, nan where it
    has none. member, surface: pairs of item and the scene's surface that belongs to it, sorted by item.  inset (s,):
    which of the scene's surfaces make a hole, a boss or a duct: its edges are not those of what it is cut into.
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
    inset: Bools

    def __len__(self) -> int:
        return len(self.path)


def list_items(stored: StoredScene, parts: PartsInView, seen: Sequence[SurfaceMap]) -> Items:
    """All that is in view of inspected objects; seen: by camera."""
    scene, rows = stored.scene, stored.features
    occurrence = np.searchsorted(stored.occurrence_id, parts.occurrence_id)
    kept = np.flatnonzero(scene.inspected[occurrence])
    occurrence, feature_no = occurrence[kept], parts.feature_no[kept]
    visible = np.zeros(len(stored.surface_no))
    for shown in seen:
        visible += shown.count_pixels(len(visible))
    faces = np.flatnonzero((visible > 0) & scene.inspected[scene.surface_occurrence])

    # Surfaces of a feature stand together; those of a part are of its occurrence.
    shape, number = (np.asarray(rows[name], np.int64) for name in ("shape_id", "feature_no"))
    first = np.flatnonzero((np.diff(shape, prepend=-1) != 0) | (np.diff(number, prepend=-1) != 0))
    those = dict(
        zip(zip(shape[first].tolist(), number[first].tolist(), strict=True), _slices(first, len(shape)), strict=True)
    )
    by_number = {
        (o, n): s
        for s, (o, n) in enumerate(zip(scene.surface_occurrence.tolist(), stored.surface_no.tolist(), strict=True))
    }
    of_inset = np.isin(np.asarray(rows["kind"], str), INSETS)
    insets = set(zip(shape[of_inset].tolist(), np.asarray(rows["surface_no"])[of_inset].tolist(), strict=True))
    names = zip(stored.shape_id[scene.surface_occurrence].tolist(), stored.surface_no.tolist(), strict=True)
    kind, thickness, surfaces = [""] * len(kept), np.full(len(kept), np.nan), []
    for row, (o, f) in enumerate(zip(occurrence.tolist(), feature_no.tolist(), strict=True)):
        if f == PART:
            surfaces.append(np.flatnonzero(scene.surface_occurrence == o))
            continue
        mine = those[int(stored.shape_id[o]), f]
        surfaces.append(np.array([by_number[o, int(n)] for n in rows["surface_no"][mine]], np.int64))
        kind[row] = str(rows["kind"][mine][0])
        value = rows["thickness"][mine][0]
        thickness[row] = np.nan if value is None else float(value)
    named = zip(scene.surface_occurrence[faces].tolist(), stored.surface_no[faces].tolist(), strict=True)
    none = np.full(len(faces), NONE)
    return Items(
        level=["part" if f == PART else "feature" for f in feature_no] + ["surface"] * len(faces),
        occurrence=np.concatenate([occurrence, scene.surface_occurrence[faces]]),
        feature_no=np.concatenate([np.where(feature_no == PART, NONE, feature_no), none]),
        surface_no=np.concatenate([np.full(len(kept), NONE), stored.surface_no[faces]]),
        path=[parts.path[k] for k in kept] + [f"{stored.paths[o]}/face {n}" for o, n in named],
        kind=kind + [""] * len(faces),
        visible_px=np.concatenate([parts.visible[kept], visible[faces]]),
        thickness=np.concatenate([thickness, np.full(len(faces), np.nan)]),
        member=np.concatenate(
            [np.repeat(np.arange(len(kept)), [len(s) for s in surfaces]), len(kept) + np.arange(len(faces))]
        ),
        surface=np.concatenate([*surfaces, faces]),
        inset=np.array([name in insets for name in names], bool),
    )


def _slices(first: Ints, end: int) -> list[slice]:
    return [slice(a, b) for a, b in pairwise([*first.tolist(), end])]
