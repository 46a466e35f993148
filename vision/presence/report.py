"""What is there and what is not, the worst first for people and programs, which variant it is, the store's rows."""

from __future__ import annotations

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import ColumnValues, Ints, Ragged, fields_of, list_rows
from relmodel.store.runs import Writer
from vision.account.runs import take_account
from vision.localisation.localise import Localisation
from vision.localisation.views import Observation, view_model
from vision.localisation.visibility import find_parts_in_view
from vision.presence.displaced import unit_of
from vision.presence.items import KINDS, NONE, Appearance
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
FAILING = (CONTRADICTED, CHANGED, NOT_CONFIRMED)
# What is known to be as modelled or not.
CHECKED = (CONTRADICTED, CHANGED, CONFIRMED)
_MOST_SAID = 12


def rank_failures(rows: Mapping[str, Any]) -> Ints:
    """Parts and features that are not as the model says, worst first: by state, then by evidence; of the columns of the
    table `presence`.  A part that fails by its features alone is left out: they stand for it."""
    level, state, reason, log_odds, moved = (
        np.asarray(rows[name]) for name in ("level", "state", "reason", "log_odds", "moved_log_odds")
    )
    place = np.argmax(state[:, None] == [STATES[s] for s in SEVERITY], axis=1)
    failing = np.isin(place, [SEVERITY.index(s) for s in FAILING])
    shown = np.flatnonzero(failing & (level != "surface") & (reason != REASONS[OF_FEATURE]))
    evidence = np.fmax(-log_odds, np.nan_to_num(moved))[shown]
    return np.asarray(shown[np.lexsort((-evidence, place[shown]))])


def summarise(presence: Mapping[str, Any]) -> list[str]:
    """Sentences on how much was checked, each of the worst, and what the model does not account for; of `describe`."""
    words = []
    for name in ("part", "feature"):
        found = presence["checked"][name]
        counted = [f"{found[STATES[s]]} {STATES[s].replace('_', ' ')}" for s in SEVERITY if found[STATES[s]]]
        words.append(f"checked {found['checked']} of {found['of']} {name}s in view: {', '.join(counted) or 'none'}")
    items, failures = {item["path"]: item for item in presence["items"]}, presence["look_at"]
    words += [f"  {_describe_failure(items[path])}" for path in failures[:_MOST_SAID]]
    if len(failures) > _MOST_SAID:
        words.append(f"  and {len(failures) - _MOST_SAID} more")
    regions = sum(it["kind"] == "region" for it in presence["unexplained"])
    count = {"region": regions, "edge": len(presence["unexplained"]) - regions}
    counted = [f"{n} {what}{'s' * (n > 1)}" for what, n in count.items() if n]
    more = f"{' and '.join(counted)} in the pictures that the model does not account for"
    return [*words, more] if counted else words


def count_states(states: Sequence[str]) -> dict[str, int]:
    """How many parts, features or surfaces are checked, of how many, and in each state."""
    n = Counter(states)
    return {"checked": sum(n[STATES[s]] for s in CHECKED), "of": len(states), **{name: n[name] for name in STATES}}


def _describe_failure(item: Mapping[str, Any]) -> str:
    path, state = item["path"], item["state"].replace("_", " ")
    sizes = {it["what"]: it for it in item["measured"]}
    if "displacement" in sizes:
        far, turn = sizes["displacement"], sizes["turn"]
        along = ", ".join(f"{sizes[name]['value']:.1f}" for name in ("dx", "dy", "dz"))
        turned = f"turned by {turn['value']:.1f} degrees, sigma {turn['sigma']:.1g}; " if turn["changed"] else ""
        where = f"its middle lies {far['value']:.1f} mm from its place, sigma {far['sigma']:.1g}: {along} along x, y, z"
        return f"{path}: {state}, {turned}{where}"
    for it in item["measured"]:
        if it["changed"] and it["what"] != "offset":
            words = f"{it['value']:.2f} mm, not {it['nominal']:.6g}, sigma {it['sigma']:.2g}"
            return f"{path}: {state}, {it['what']} {words}"
    moved = item["moved"]
    if moved is not None and item["state"] == STATES[CHANGED]:
        way = "out" if moved["mm"] > 0 else "in"
        return f"{path}: {state}, a face of it lies {abs(moved['mm']):.2f} mm {way}, sigma {moved['sigma_mm']:.2g}"
    return f"{path}: {state}, {item['reason']}"


def tabulate_presence(it: Presence) -> dict[str, dict[str, Any]]:
    """The rows of an assessment: of each of its tables the columns but the run and the placed part."""
    evidence, sizes, more = vars(it.evidence), it.measures, it.signs.unexplained
    count, cameras = it.evidence.log_odds.shape
    return {
        "presence": tabulate_items(it),
        "presence_camera": {
            "item_no": np.repeat(np.arange(count), cameras),
            "camera": it.cameras * count,
            **{name: values.ravel() for name, values in evidence.items()},
            **_appearance(it.signs.appearance, count, cameras),
        },
        "measured_size": {
            "measure_no": np.arange(len(sizes)),
            "item_no": sizes.item,
            "other_item_no": np.ma.masked_equal(sizes.other, NONE),
            "unit": [unit_of(what) for what in sizes.what],
            **fields_of(sizes, "what nominal value sigma changed"),
        },
        "unexplained": {
            "unexplained_no": np.arange(len(more)),
            "camera": [it.cameras[c] for c in more.camera],
            "kind": [KINDS[k] for k in more.kind],
            "image_arc_no": np.ma.masked_equal(more.arc, NONE),
            "region_no": np.ma.masked_equal(more.region, NONE),
            **{name: more.box[:, k] for k, name in enumerate(("u0", "v0", "u1", "v1"))},
            **fields_of(more, "length contrast beyond"),
        },
    }


def tabulate_items(it: Presence) -> dict[str, Any]:
    """The rows of its parts, features and surfaces: the columns of the table `presence` likewise."""
    return {
        "item_no": np.arange(len(it.state)),
        **fields_of(it.items, "level path"),
        "feature_no": np.ma.masked_equal(it.items.feature_no, NONE),
        "surface_no": np.ma.masked_equal(it.items.surface_no, NONE),
        "state": [STATES[s] for s in it.state],
        "qif": [QIF[s] for s in it.state],
        "reason": [REASONS[r] for r in it.reason],
        **{name: values.sum(axis=1) for name, values in vars(it.evidence).items()},
        "visible_pixels": it.items.visible_px,
        "absent_log_odds": it.signs.absent,
        **fields_of(it, "moved_mm moved_sigma_mm moved_log_odds uncovered_log_odds"),
    }


def describe(tables: Mapping[str, Mapping[str, Any]]) -> dict[str, Any]:
    """What an assessment says in plain lists and numbers, by its tables' columns; parts, then features, surfaces."""
    rows = {name: list_rows(columns) for name, columns in tables.items()}
    items = rows["presence"]
    seen, sizes = defaultdict(list), defaultdict(list)
    for row in rows["presence_camera"]:
        seen[row["item_no"]].append(row)
    for row in rows["measured_size"]:
        sizes[row["item_no"]].append(row)
    return {
        "checked": {
            level: count_states([row["state"] for row in items if row["level"] == level])
            for level in ("part", "feature", "surface")
        },
        "look_at": [items[row]["path"] for row in rank_failures(tables["presence"]).tolist()] if items else [],
        "items": [
            {
                **{name: row[name] for name in ("path", "level", "state", "qif", "reason")},
                **_rounded(row, "log_odds expected_log_odds", 3),
                **_rounded(row, "visible_pixels edge_px distinct_px supported_px", 1),
                "cameras": {
                    one["camera"]: _rounded(one, "log_odds", 3) | _rounded(one, "supported_px distinct_px", 1)
                    for one in seen[row["item_no"]]
                },
                "moved": None
                if np.isnan(row["moved_mm"])
                else {
                    "mm": round(row["moved_mm"], 4),
                    "sigma_mm": round(row["moved_sigma_mm"], 4),
                    "log_odds": round(row["moved_log_odds"], 3),
                },
                "measured": [
                    {"what": one["what"], **_rounded(one, _SIZE, 4), "unit": one["unit"], "changed": one["changed"]}
                    for one in sizes[row["item_no"]]
                    if one["what"] != "distance"
                ],
                "appearance": [
                    {
                        "camera": one["camera"],
                        "grey": round(one["inside_grey"], 1),
                        "around": round(one["around_grey"], 1),
                        "like": round(one["like_grey"], 1),
                        "log_odds": round(one["appearance_log_odds"], 2),
                        "stopped": bool(one["stopped"]),
                    }
                    for one in seen[row["item_no"]]
                    if _is_known(one["inside_grey"])
                ],
            }
            for row in items
        ],
        "distances": [
            {
                "from": items[row["item_no"]]["path"],
                "to": items[int(row["other_item_no"])]["path"],
                **_rounded(row, _SIZE, 4),
                "changed": row["changed"],
            }
            for row in rows["measured_size"]
            if row["what"] == "distance"
        ],
        "unexplained": [
            {
                **{name: row[name] for name in ("camera", "kind")},
                **{n: int(row[n]) if _is_known(row[n]) else None for n in ("image_arc_no", "region_no")},
                "box": [round(row[name], 1) for name in ("u0", "v0", "u1", "v1")],
                **_rounded(row, "length contrast", 1),
                "beyond": row["beyond"],
            }
            for row in rows["unexplained"]
        ],
    }


_SIZE = "nominal value sigma"


def _is_known(value: float | None) -> bool:
    return value is not None and value == value  # a store's null is NaN among numbers


def _rounded(row: Mapping[str, Any], names: str, digits: int) -> dict[str, float]:
    """Some numbers of a row."""
    return {name: round(row[name], digits) for name in names.split()}


@dataclass(frozen=True)
class VariantEvidence:
    """What the pictures say of a variant in the place of the one that the world has there.

    object_no: of the world's object; placed: whether it is the world's; log_odds: the sum over its visible edges,
    each there against not there; against: how many of its features and parts in view differ from it; decided: how many
    are decided at all.  distinguished_by: paths, worst first, of those that differ from it, and that the
    likeliest variant has right or does not have."""

    object_no: int
    name: str
    variant: str
    object_variant_id: int
    placed: bool
    log_odds: float
    against: int
    decided: int
    distinguished_by: list[str]


def assess_variant(
    variant: Mapping[str, Any], stored: StoredScene, seen: Observation, found: Localisation, p: PresenceParameters
) -> VariantEvidence:
    """The evidence for a variant, a row of `variants_in_world`, at the best pose; stored: the world with it."""
    assert found.best is not None
    pose = found.best.world_from_rig
    view = view_model(stored.scene, found.rig, pose)
    parts = find_parts_in_view(stored, found.rig, view.maps, pose)
    account = take_account(stored, found.rig, found.best, found.edge_indexes, view.arcs, p.account)
    return weigh_variant(variant, assess(stored, seen, found, view, parts, account, p))


def weigh_variant(variant: Mapping[str, Any], presence: Presence) -> VariantEvidence:
    """The evidence for a variant from what is there and what is not at its place."""
    decided = (np.array(presence.items.level) != "surface") & (presence.state != UNDECIDABLE)
    failures = [presence.items.path[row] for row in rank_failures(tabulate_items(presence)).tolist()]
    return VariantEvidence(
        int(variant["object_no"]), str(variant["name"]), str(variant["variant"]), int(variant["object_variant_id"]),
        bool(variant["placed"]), float(np.sum(presence.signs.runs.log_odds)), len(failures),
        int(decided.sum()), failures,
    )  # fmt: skip


def rank(variants: list[VariantEvidence]) -> list[VariantEvidence]:
    """By object, the likeliest first; each with what distinguishes it from that."""
    ranked = sorted(variants, key=lambda v: (v.object_no, -v.log_odds, v.variant))
    likeliest = {v.object_no: set(v.distinguished_by) for v in reversed(ranked)}
    return [
        replace(v, distinguished_by=[path for path in v.distinguished_by if path not in likeliest[v.object_no]])
        for v in ranked
    ]


_WEIGHED = ("object_no", "object_variant_id", "placed", "log_odds", "against", "decided")


def record_presence(write: Writer, stored: StoredScene, it: Presence) -> None:
    """Append all rows of an assessment; write: as `Run.writer`."""
    for table, columns in tabulate_presence(it).items():
        own = {"occurrence_id": stored.occurrence_id[it.items.occurrence]} if table == "presence" else {}
        write(table, **own, **columns)


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


def record_variants(write: Writer, ranked: list[VariantEvidence]) -> None:
    """Append the evidence for variants, in their order; write: as `Run.writer`."""
    write(
        "variant_evidence",
        rank_no=np.arange(len(ranked)),
        **{name: [getattr(v, name) for v in ranked] for name in _WEIGHED},
        distinguished_by=Ragged.pack([v.distinguished_by or None for v in ranked], object),
    )
