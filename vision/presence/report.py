"""What is there and what is not, the worst first for people and programs, which variant that is, and the rows of the
store.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt
from sqlalchemy import Connection

from relmodel.arrays import ColumnValues, Ints
from relmodel.store import Run
from vision.localisation.localisation_parameters import LocalisationParameters
from vision.localisation.localise import Localisation
from vision.localisation.views import Observation, view_model
from vision.localisation.visibility import find_parts_in_view
from vision.presence.displaced import unit_of
from vision.presence.items import KINDS, NONE, REGION, Appearance
from vision.presence.items import NONE as NOTHING
from vision.presence.presence_parameters import PresenceParameters
from vision.presence.states import (
    CHANGED,
    CONFIRMED,
    CONTRADICTED,
    NOT_CONFIRMED,
    OF_FEATURE,
    QIF,
    REASONS,
    STATES,
    UNDECIDABLE,
    Presence,
    assess,
)
from vision.scene import StoredScene

# From what to look at first to what needs no look.
SEVERITY = (CONTRADICTED, CHANGED, NOT_CONFIRMED, UNDECIDABLE, CONFIRMED)
# What is known to be as modelled or not.
CHECKED = (CONTRADICTED, CHANGED, CONFIRMED)
_MOST_SAID = 12


def rank_failures(presence: Presence) -> Ints:
    """Parts and features that are not as the model says, worst first: by state, then by evidence.  A part that
    fails by its features alone is left out: they stand for it."""
    shown = (np.array(presence.items.level) != "surface") & (presence.reason != OF_FEATURE)
    rows = np.flatnonzero(shown & ~np.isin(presence.state, (CONFIRMED, UNDECIDABLE)))
    place = np.argsort(SEVERITY)[presence.state[rows]]
    evidence = np.fmax(-presence.evidence.log_odds.sum(axis=1), np.nan_to_num(presence.moved_log_odds))[rows]
    return np.asarray(rows[np.lexsort((-evidence, place))])


def count_against(presence: Presence) -> tuple[int, int]:
    """How many parts and features are not as the model says, and how many are decided."""
    counted = np.array(presence.items.level) != "surface"
    return len(rank_failures(presence)), int(np.sum(counted & (presence.state != UNDECIDABLE)))


def summarise(presence: Presence) -> list[str]:
    """A sentence on how much was checked, one for each of the worst, and one on what the model does not account for."""
    words = []
    level = np.array(presence.items.level)
    for name in ("part", "feature"):
        count = np.bincount(presence.state[level == name], minlength=len(STATES))
        decided = int(count[list(CHECKED)].sum())
        counted = [f"{count[s]} {STATES[s].replace('_', ' ')}" for s in SEVERITY if count[s]]
        words.append(f"checked {decided} of {int(count.sum())} {name}s in view: {', '.join(counted) or 'none'}")
    failures = rank_failures(presence)
    words += [f"  {_describe_failure(presence, int(row))}" for row in failures[:_MOST_SAID]]
    if len(failures) > _MOST_SAID:
        words.append(f"  and {len(failures) - _MOST_SAID} more")
    words += _count_unexplained(presence)
    return words


def _count_unexplained(presence: Presence) -> list[str]:
    regions = int(np.sum(presence.unexplained.kind == REGION))
    count = {"region": regions, "edge": len(presence.unexplained.kind) - regions}
    counted = [f"{n} {what}{'s' * (n > 1)}" for what, n in count.items() if n]
    return [f"{' and '.join(counted)} in the pictures that the model does not account for"] if counted else []


def _describe_failure(presence: Presence, row: int) -> str:
    state, path = STATES[presence.state[row]].replace("_", " "), presence.items.path[row]
    sizes, mine = presence.measures, np.flatnonzero(presence.measures.item == row)
    counted = {sizes.what[k]: (sizes.value[k], sizes.sigma[k]) for k in mine.tolist()}
    surely = {sizes.what[k] for k in mine[sizes.changed[mine]].tolist()}
    if "displacement" in counted:
        (far, sigma), (turn, turn_sigma) = counted["displacement"], counted["turn"]
        along = ", ".join(f"{counted[name][0]:.1f}" for name in ("dx", "dy", "dz"))
        turned = f"turned by {turn:.1f} degrees, sigma {turn_sigma:.1g}; " if "turn" in surely else ""
        where = f"its middle lies {far:.1f} mm from its place, sigma {sigma:.1g}: {along} along x, y, z"
        return f"{path}: {state}, {turned}{where}"
    for k in mine[sizes.changed[mine] & (np.array(sizes.what)[mine] != "offset")].tolist():
        words = f"{sizes.value[k]:.2f} mm, not {sizes.nominal[k]:.6g}, sigma {sizes.sigma[k]:.2g}"
        return f"{path}: {state}, {sizes.what[k]} {words}"
    if np.isfinite(presence.moved_mm[row]) and presence.state[row] == CHANGED:
        far, sigma = presence.moved_mm[row], presence.moved_sigma_mm[row]
        return f"{path}: {state}, a face of it lies {abs(far):.2f} mm {'out' if far > 0 else 'in'}, sigma {sigma:.2g}"
    return f"{path}: {state}, {REASONS[presence.reason[row]]}"


def _rounded(columns: Mapping[str, Any], at: int | tuple[int, int], **digits: int) -> dict[str, float]:
    """The numbers at a place of columns, each rounded to as many digits."""
    return {name: round(float(columns[name][at]), count) for name, count in digits.items()}


def describe(presence: Presence) -> dict[str, Any]:
    """Everything in plain lists and numbers; items parts first, then features and surfaces."""
    items, evidence, sizes, more = presence.items, presence.evidence, presence.measures, presence.unexplained
    total = {name: getattr(evidence, name).sum(axis=1) for name in evidence.__dataclass_fields__}
    measured: list[list[dict[str, Any]]] = [[] for _ in range(len(items))]
    for k, row in enumerate(sizes.item.tolist()):
        measured[row].append(
            {
                "what": sizes.what[k],
                **_rounded(vars(sizes), k, nominal=4, value=4, sigma=4),
                "unit": unit_of(sizes.what[k]),
                "changed": bool(sizes.changed[k]),
            }
        )
    looks: list[list[dict[str, Any]]] = [[] for _ in range(len(items))]
    for k, row in enumerate(presence.appearance.item.tolist()):
        looks[row].append(
            {
                "camera": presence.cameras[presence.appearance.camera[k]],
                **_rounded(vars(presence.appearance), k, grey=1, around=1, like=1, log_odds=2),
                "stopped": bool(presence.appearance.stopped[k]),
            }
        )
    apart = presence.distances
    level = np.array(items.level)
    count = {
        name: np.bincount(presence.state[level == name], minlength=len(STATES))
        for name in ("part", "feature", "surface")
    }
    return {
        "checked": {
            name: {
                "checked": int(n[list(CHECKED)].sum()),
                "of": int(n.sum()),
                **{STATES[s]: int(n[s]) for s in range(len(STATES))},
            }
            for name, n in count.items()
        },
        "look_at": [items.path[row] for row in rank_failures(presence).tolist()],
        "items": [
            {
                "path": items.path[row],
                "level": items.level[row],
                "state": STATES[presence.state[row]],
                "qif": QIF[presence.state[row]],
                "reason": REASONS[presence.reason[row]],
                "log_odds": round(float(total["log_odds"][row]), 3),
                "expected_log_odds": round(float(total["expected"][row]), 3),
                "visible_pixels": round(float(items.visible_px[row]), 1),
                **_rounded(total, row, edge_px=1, distinct_px=1, supported_px=1, region_px=1),
                "cameras": {
                    name: _rounded(vars(evidence), (row, c), log_odds=3, supported_px=1, distinct_px=1, region_px=1)
                    for c, name in enumerate(presence.cameras)
                },
                "moved": None
                if np.isnan(presence.moved_mm[row])
                else {
                    "mm": round(float(presence.moved_mm[row]), 4),
                    "sigma_mm": round(float(presence.moved_sigma_mm[row]), 4),
                    "log_odds": round(float(presence.moved_log_odds[row]), 3),
                },
                "measured": measured[row],
                "appearance": looks[row],
            }
            for row in range(len(items))
        ],
        "distances": [
            {
                "from": items.path[apart.item_a[k]],
                "to": items.path[apart.item_b[k]],
                **_rounded(vars(apart), k, nominal=4, value=4, sigma=4),
                "changed": bool(apart.changed[k]),
            }
            for k in range(len(apart.item_a))
        ],
        "unexplained": [
            {
                "camera": presence.cameras[more.camera[k]],
                "kind": KINDS[more.kind[k]],
                "image_arc_no": None if more.kind[k] == REGION else int(more.arc[k]),
                "region_no": int(more.region[k]) if more.kind[k] == REGION else None,
                "box": [round(float(v), 1) for v in more.box[k]],
                **_rounded(vars(more), k, length=1, contrast=1),
                "beyond": bool(more.beyond[k]),
            }
            for k in range(len(more.arc))
        ],
    }


# Which loaded variant of an object the pictures show: the evidence for each at one pose, ranked.


@dataclass(frozen=True)
class VariantEvidence:
    """What the pictures say of a variant in the place of the one that the world has there.

    object_no: of the world's object; placed: whether it is the world's; log_odds: the sum over its visible edges,
    each there against not there; against: how many of its features and parts in view differ from it; of: how many are
    decided at all.  distinguished_by: paths, worst first, of those that differ from it, and that the
    likeliest variant has right or does not have.
    """

    object_no: int
    name: str
    variant: str
    object_variant_id: int
    placed: bool
    log_odds: float
    against: int
    of: int
    distinguished_by: list[str]

    def to_json(self) -> dict[str, Any]:
        return {
            "object": self.name,
            "variant": self.variant,
            "placed": self.placed,
            "log_odds": round(self.log_odds, 3),
            "against": self.against,
            "of": self.of,
            "distinguished_by": self.distinguished_by,
        }


def assess_variant(
    variant: Mapping[str, Any],
    stored: StoredScene,
    seen: Observation,
    found: Localisation,
    localisation: LocalisationParameters,
    p: PresenceParameters,
) -> VariantEvidence:
    """The evidence for a variant, a row of `variants_in_world`, at the best pose; stored: the world with it in its
    place."""
    assert found.best is not None
    pose = found.best.world_from_rig
    view = view_model(stored.scene, found.rig, pose, localisation)
    parts = find_parts_in_view(stored, found.rig, view.maps, pose, localisation)
    return weigh_variant(variant, assess(stored, seen, found, view, parts, {}, p))


def weigh_variant(variant: Mapping[str, Any], presence: Presence) -> VariantEvidence:
    """The evidence for a variant from what is there and what is not at its place."""
    against, decided = count_against(presence)
    failures = [presence.items.path[row] for row in rank_failures(presence).tolist()]
    return VariantEvidence(
        int(variant["object_no"]), str(variant["name"]), str(variant["variant"]), int(variant["object_variant_id"]),
        bool(variant["placed"]), float(np.sum(presence.runs.log_odds)), against, decided, failures,
    )  # fmt: skip


def rank(variants: list[VariantEvidence]) -> list[VariantEvidence]:
    """By object, the likeliest first; each with what distinguishes it from that."""
    ranked = sorted(variants, key=lambda v: (v.object_no, -v.log_odds, v.variant))
    likeliest = {v.object_no: set(v.distinguished_by) for v in reversed(ranked)}
    return [
        replace(v, distinguished_by=[path for path in v.distinguished_by if path not in likeliest[v.object_no]])
        for v in ranked
    ]


# What is there and what is not, as rows of the store.

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
