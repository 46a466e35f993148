"""What is there and what is not, as rows of the store."""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection

from relmodel.store import Run
from vision.presence.items import NONE
from vision.presence.measures import unit_of
from vision.presence.states import QIF, REASONS, STATES, Presence
from vision.presence.unexplained import KINDS
from vision.presence.unexplained import NONE as NOTHING
from vision.presence.variants import VariantEvidence
from vision.scene.stored_scene import StoredScene

MOST_TOLD = 5  # parts and features that are named of those that tell two variants apart


def record_presence(run: Run, connection: Connection, stored: StoredScene, it: Presence) -> None:
    """Append all rows of an assessment within the transaction of `connection`."""
    items, evidence = it.items, it.evidence
    count, cameras = evidence.log_odds.shape
    run.append(
        connection,
        "presence",
        {
            "run_id": run.id,
            "item_no": np.arange(count),
            "level": items.level,
            "occurrence_id": stored.occurrence_id[items.occurrence],
            "feature_no": np.ma.masked_equal(items.feature_no, NONE),
            "surface_no": np.ma.masked_equal(items.surface_no, NONE),
            "path": items.path,
            "state": [STATES[s] for s in it.state],
            "qif": [QIF[s] for s in it.state],
            "reason": [REASONS[r] for r in it.reason],
            "log_odds": evidence.log_odds.sum(axis=1),
            "expected_log_odds": evidence.expected.sum(axis=1),
            "visible_pixels": items.visible_px,
            "edge_px": evidence.edge_px.sum(axis=1),
            "distinct_px": evidence.distinct_px.sum(axis=1),
            "supported_px": evidence.supported_px.sum(axis=1),
            "region_px": evidence.region_px.sum(axis=1),
            "moved_mm": it.moved_mm,
            "moved_sigma_mm": it.moved_sigma_mm,
            "moved_log_odds": it.moved_log_odds,
        },
    )
    run.append(
        connection,
        "presence_camera",
        {
            "run_id": run.id,
            "item_no": np.repeat(np.arange(count), cameras),
            "camera": it.cameras * count,
            "log_odds": evidence.log_odds.ravel(),
            "expected_log_odds": evidence.expected.ravel(),
            "edge_px": evidence.edge_px.ravel(),
            "distinct_px": evidence.distinct_px.ravel(),
            "supported_px": evidence.supported_px.ravel(),
            "region_px": evidence.region_px.ravel(),
        },
    )
    sizes = it.measures
    run.append(
        connection,
        "measured_size",
        {
            "run_id": run.id,
            "measure_no": np.arange(len(sizes.item)),
            "item_no": sizes.item,
            "what": sizes.what,
            "nominal": sizes.nominal,
            "value": sizes.value,
            "sigma": sizes.sigma,
            "unit": [unit_of(what) for what in sizes.what],
            "changed": sizes.changed,
        },
    )
    apart = it.distances
    run.append(
        connection,
        "measured_distance",
        {
            "run_id": run.id,
            "distance_no": np.arange(len(apart.item_a)),
            "item_no": apart.item_a,
            "other_item_no": apart.item_b,
            "nominal": apart.nominal,
            "value": apart.value,
            "sigma": apart.sigma,
            "changed": apart.changed,
        },
    )
    holes = it.openings
    run.append(
        connection,
        "seen_through",
        {
            "run_id": run.id,
            "item_no": holes.item,
            "camera": [it.cameras[c] for c in holes.camera],
            "image_region_no": holes.region,
            "pixels": holes.pixels,
            "grey": holes.grey,
            "behind_grey": holes.behind,
            "behind_sigma": holes.sigma,
            "stopped": holes.stopped,
        },
    )
    more = it.unexplained
    run.append(
        connection,
        "unexplained",
        {
            "run_id": run.id,
            "unexplained_no": np.arange(len(more.arc)),
            "camera": [it.cameras[c] for c in more.camera],
            "kind": [KINDS[k] for k in more.kind],
            "image_arc_no": np.ma.masked_equal(more.arc, NOTHING),
            "region_no": np.ma.masked_equal(more.region, NOTHING),
            **{name: more.box[:, k] for k, name in enumerate(("u0", "v0", "u1", "v1"))},
            "length": more.length,
            "contrast": more.contrast,
            "beyond": more.beyond,
        },
    )


def record_variants(run: Run, connection: Connection, ranked: list[VariantEvidence]) -> None:
    """Append what the pictures say of variants, in their order; nothing where none was asked for."""
    if ranked:
        run.append(
            connection,
            "variant_evidence",
            {
                "run_id": run.id,
                "rank_no": np.arange(len(ranked)),
                "object_no": [v.object_no for v in ranked],
                "object_variant_id": [v.object_variant_id for v in ranked],
                "placed": [v.placed for v in ranked],
                "log_odds": [v.log_odds for v in ranked],
                "against": [v.against for v in ranked],
                "decided": [v.of for v in ranked],
                "told_by": [", ".join(v.told_by[:MOST_TOLD]) or None for v in ranked],
            },
        )
