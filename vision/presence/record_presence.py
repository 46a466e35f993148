"""What is there and what is not, as rows of the store."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.columns import ColumnValues
from relmodel.store import Run
from vision.presence.appearance import Appearance
from vision.presence.items import NONE
from vision.presence.measures import unit_of
from vision.presence.states import QIF, REASONS, STATES, Presence
from vision.presence.unexplained import KINDS
from vision.presence.unexplained import NONE as NOTHING
from vision.presence.variants import VariantEvidence
from vision.scene.stored_scene import StoredScene

MOST_DISTINGUISHING = 5  # parts and features named, of those that distinguish two variants


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
            **_appearance(it.appearance, count, cameras),
        },
    )
    sizes, apart = it.measures, it.distances
    what = [*sizes.what, *["distance"] * len(apart.item_a)]
    run.append(
        connection,
        "measured_size",
        {
            "run_id": run.id,
            "measure_no": np.arange(len(what)),
            "item_no": np.concatenate([sizes.item, apart.item_a]),
            "other_item_no": np.ma.masked_equal(np.concatenate([np.full(len(sizes.item), NONE), apart.item_b]), NONE),
            "what": what,
            **{n: np.concatenate([getattr(sizes, n), getattr(apart, n)]) for n in ("nominal", "value", "sigma")},
            "unit": [unit_of(w) for w in what],
            "changed": np.concatenate([sizes.changed, apart.changed]),
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


def _appearance(seen: Appearance, count: int, cameras: int) -> dict[str, ColumnValues]:
    """What features look like, as columns (count * cameras,) of items by camera; null of others."""
    at = seen.item * cameras + seen.camera
    others = np.ones(count * cameras, np.bool_)
    others[at] = False

    def column(values: npt.NDArray[Any]) -> ColumnValues:
        out = np.zeros(count * cameras, values.dtype)
        out[at] = values
        return np.ma.masked_array(out, others)

    return {
        "inside_grey": column(seen.grey),
        "around_grey": column(seen.around),
        "like_grey": column(seen.like),
        "appearance_log_odds": column(seen.log_odds),
        "stopped": column(seen.stopped),
    }


def record_variants(run: Run, connection: Connection, ranked: list[VariantEvidence]) -> None:
    """Append the evidence for variants, in their order; nothing where none was asked for."""
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
                "distinguished_by": [", ".join(v.distinguished_by[:MOST_DISTINGUISHING]) or None for v in ranked],
            },
        )
