"""The loaded variants of a world's inspected objects, weighed at the pose that an inspection found."""

from __future__ import annotations

from relmodel.store import Run
from vision.inspection.inspection_parameters import InspectionParameters
from vision.inspection.locate import Target
from vision.localisation.localise import Localisation
from vision.localisation.observation import Observation
from vision.presence.report import rank_failures
from vision.presence.states import Presence
from vision.presence.variants import VariantEvidence, assess_variant, rank, weigh_variant
from vision.scene.stored_scene import read_variant_scene


def is_to_be_weighed(presence: Presence, asked: bool | None) -> bool:
    """Whether variants are weighed: as asked, where nothing was said if a part or feature is not as the model says."""
    return bool(len(rank_failures(presence))) if asked is None else asked


def weigh_variants(
    run: Run,
    target: Target,
    seen: Observation,
    found: Localisation,
    presence: Presence | None,
    p: InspectionParameters,
    most: int | None = None,
) -> list[VariantEvidence]:
    """Rank the loaded variants of the world's inspected objects by their evidence at the best pose.

    presence: that of the variants that the world has, where it is known already; most: so many others are weighed, and
    none where there are more.
    """
    out, store, world_id = [], run.store, target.stored.world_id
    with store.read() as connection:
        found_rows = store.rows(connection, "world/variants", world_id=world_id, run=run.id)
    rows = [dict(row._mapping) for row in found_rows]
    others = sum(not row["placed"] for row in rows)
    if most is not None and not 1 <= others <= most:
        return []
    for row in rows:
        if row["placed"] and presence is not None:
            out.append(weigh_variant(row, presence))
            continue
        with store.read() as connection:
            scene = read_variant_scene(store, connection, world_id, target.selection.occurrence_id.tolist(), row)
        store.release()
        out.append(assess_variant(row, scene, seen, found, p.localisation, p.presence))
    return rank(out)
