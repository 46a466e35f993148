"""What the cameras of a rig saw together, and what they should see of a model."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field

from relmodel.arrays import Bools, Bytes, Floats
from vision.cameras.cameras import Rig
from vision.extraction.primitives import Primitives
from vision.localisation.coverage import SurfaceMap, map_views
from vision.localisation.localisation_parameters import LocalisationParameters
from vision.localisation.views import ViewArcs, find_view_arcs
from vision.scene.scene import Scene


@dataclass(frozen=True)
class Observation:
    """What the cameras of a rig saw together, by camera: what was extracted from their pictures, and the greys (rows,
    columns) of these.

    partnered: of the cameras of a stereo pair, which image arcs (n,) have a partner in the other's picture.
    """

    rig: Rig
    pictures: Mapping[str, Primitives]
    greys: Mapping[str, Bytes | Floats]
    partnered: Mapping[str, Bools] = field(default_factory=dict)

    def only(self, names: Iterable[str]) -> Observation:
        """What some of the cameras saw."""
        rig = self.rig.only(*names)
        pictures = {name: self.pictures[name] for name in rig.cameras}
        return Observation(rig, pictures, {name: self.greys[name] for name in rig.cameras})


@dataclass(frozen=True)
class ModelView:
    """What the cameras of a rig should see of a model at a pose, by camera: its arcs, and which of its surfaces each
    place of the picture shows."""

    arcs: Mapping[str, ViewArcs]
    maps: Mapping[str, SurfaceMap]


def view_model(
    scene: Scene,
    rig: Rig,
    world_from_rig: Floats,
    p: LocalisationParameters,
    arcs: Mapping[str, ViewArcs] | None = None,
) -> ModelView:
    """What a rig's cameras should see of a scene at a pose; arcs: those in view, where they are known."""
    if arcs is None:
        arcs = {
            name: find_view_arcs(scene, camera, world_from_rig @ rig.rig_from_camera[name], p)
            for name, camera in rig.cameras.items()
        }
    return ModelView(arcs, map_views(scene, rig, world_from_rig, p))
