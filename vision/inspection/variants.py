"""The loaded variants of a world's inspected objects, weighed at the pose that an inspection found."""

from __future__ import annotations

from collections.abc import Mapping

from relmodel.arrays import Bytes, Floats
from relmodel.store import Run
from vision.cameras.cameras import Rig
from vision.cameras.view_volume import Selection
from vision.extraction.primitives import Primitives
from vision.inspection.inspection_parameters import InspectionParameters
from vision.localisation.localise import Localisation
from vision.presence.report import rank_failures
from vision.presence.states import Presence
from vision.presence.variants import VariantEvidence, assess_variant, rank, weigh_variant
from vision.scene.stored_scene import StoredScene, read_variant_scene


def is_to_be_weighed(presence: Presence, asked: bool | None) -> bool:
    """Whether variants are weighed: as asked, where nothing was said if a part or feature is not as the model says."""
    return bool(len(rank_failures(presence))) if asked is None else asked


def weigh_variants(
    run: Run,
    stored: StoredScene,
    selection: Selection,
    rig: Rig,
    pictures: dict[str, Primitives],
    greys: Mapping[str, Bytes | Floats],
    found: Localisation,
    presence: Presence | None,
    parameters: InspectionParameters,
    most: int | None = None,
) -> list[VariantEvidence]:
    """The evidence at the best pose for each loaded variant of the world's inspected objects; nothing where there are
    none but those that it has, or more than `most`.  presence: that of those, where it is known already."""
    assert found.best is not None
    among = selection.occurrence_id.tolist()
    out, store = [], run.store
    with store.read() as connection:
        rows = [
            dict(row._mapping) for row in store.rows(connection, "world/variants", world_id=stored.world_id, run=run.id)
        ]
    others = sum(not row["placed"] for row in rows)
    if most is not None and not 1 <= others <= most:
        return []
    for row in rows:
        if row["placed"] and presence is not None:
            out.append(weigh_variant(row, presence))
            continue
        with store.read() as connection:
            scene = read_variant_scene(store, connection, stored.world_id, among, row)
        store.release()
        out.append(
            assess_variant(
                row,
                scene,
                rig,
                pictures,
                greys,
                found.edge_indexes,
                found.best,
                parameters.localisation,
                parameters.presence,
            )
        )
    return rank(out)
