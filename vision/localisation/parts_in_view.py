"""Which placed parts and features the cameras see at a pose, and which share of each."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from relmodel.arrays import Floats, Ints
from vision.cameras.cameras import Rig
from vision.localisation.coverage import SurfaceMap, measure_coverage
from vision.localisation.localisation_parameters import DEFAULTS, LocalisationParameters
from vision.scene.stored_scene import StoredScene

PART = -1  # feature number of a part as a whole


@dataclass(frozen=True)
class PartsInView:
    """Columns, one row a part or feature that some camera shows; feature_no is PART for parts as a whole.

    visible, covered: pixels over all cameras, shown and covered were nothing before it.
    """

    occurrence_id: Ints
    feature_no: Ints
    path: list[str]
    visible: Floats
    covered: Floats

    @property
    def level(self) -> list[str]:
        return ["part" if number == PART else "feature" for number in self.feature_no]

    def rows(self) -> list[dict[str, Any]]:
        """path, level and visible_share of each."""
        share = np.round(self.visible / self.covered, 4).tolist()
        return [
            {"path": path, "level": level, "visible_share": s}
            for path, level, s in zip(self.path, self.level, share, strict=True)
        ]


def find_parts_in_view(
    stored: StoredScene,
    rig: Rig,
    maps: Mapping[str, SurfaceMap],
    world_from_rig: Floats,
    p: LocalisationParameters = DEFAULTS,
) -> PartsInView:
    """What the cameras of a rig see at a pose (maps, by camera), parts first, each kind in the order of occurrences."""
    scene = stored.scene
    occurrences = len(stored.occurrence_id)
    occurrence, feature, paths = list(range(occurrences)), [PART] * occurrences, list(stored.paths)
    group, surface = [scene.surface_occurrence], [np.arange(len(scene.surface_occurrence))]

    rows = stored.features
    by_key = {
        (int(o), int(n)): s for s, (o, n) in enumerate(zip(scene.surface_occurrence, stored.surface_no, strict=True))
    }
    for placed, shape in enumerate(stored.shape_id.tolist()):
        mine = rows["shape_id"] == shape
        numbers, first = np.unique(rows["feature_no"][mine], return_index=True)
        names = rows["name"][mine][first]
        paths += [f"{stored.paths[placed]}/{name}" for name in names]
        occurrence += [placed] * len(numbers)
        feature += numbers.tolist()
        at = len(paths) - len(numbers)
        group.append(at + np.searchsorted(numbers, rows["feature_no"][mine]))
        surface.append(np.array([by_key[placed, int(n)] for n in rows["surface_no"][mine]], np.int64))
    groups, surfaces = np.concatenate(group), np.concatenate(surface)
    visible, covered = np.zeros(len(paths)), np.zeros(len(paths))
    for name in rig.cameras:
        found = measure_coverage(
            scene, maps[name], world_from_rig @ rig.rig_from_camera[name], groups, surfaces, len(paths), p
        )
        visible += found.visible
        covered += found.covered
    # Rays through the middles of squares may hit where no square's middle is covered: sharp outlines, by a ray or two.
    covered = np.maximum(covered, visible)
    seen = np.flatnonzero(visible > 0)
    return PartsInView(
        stored.occurrence_id[np.array(occurrence)[seen]],
        np.array(feature)[seen],
        [paths[i] for i in seen],
        visible[seen],
        covered[seen],
    )
