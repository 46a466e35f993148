"""What is there and what is not, the worst first for people and programs, which variant that is, and the rows of the
store.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import numpy.typing as npt

from relmodel.arrays import ColumnValues, Ints, fields_of
from relmodel.store.runs import Writer
from vision.localisation.localise import Localisation
from vision.localisation.views import Observation, view_model
from vision.localisation.visibility import find_parts_in_view
from vision.presence.displaced import unit_of
from vision.presence.items import KINDS, NONE, REGION, Appearance
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


def summarise(presence: Presence) -> list[str]:
    """A sentence on how much was checked, one for each of the worst, and one on what the model does not account for."""
    words = []
    for name in ("part", "feature"):
        found = count_states(presence, name)
        counted = [f"{found[STATES[s]]} {STATES[s].replace('_', ' ')}" for s in SEVERITY if found[STATES[s]]]
        words.append(f"checked {found['checked']} of {found['of']} {name}s in view: {', '.join(counted) or 'none'}")
    failures = rank_failures(presence)
    words += [f"  {_describe_failure(presence, int(row))}" for row in failures[:_MOST_SAID]]
    if len(failures) > _MOST_SAID:
        words.append(f"  and {len(failures) - _MOST_SAID} more")
    regions = int(np.sum(presence.signs.unexplained.kind == REGION))
    count = {"region": regions, "edge": len(presence.signs.unexplained) - regions}
    counted = [f"{n} {what}{'s' * (n > 1)}" for what, n in count.items() if n]
    return (
        [*words, f"{' and '.join(counted)} in the pictures that the model does not account for"] if counted else words
    )


def count_states(presence: Presence, level: str) -> dict[str, int]:
    """How many parts, features or surfaces are checked, of how many, and in each state."""
    n = np.bincount(presence.state[np.array(presence.items.level) == level], minlength=len(STATES)).tolist()
    return {"checked": sum(n[s] for s in CHECKED), "of": sum(n), **dict(zip(STATES, n, strict=True))}


def _describe_failure(presence: Presence, row: int) -> str:
    state, path = STATES[presence.state[row]].replace("_", " "), presence.items.path[row]
    sizes, what = presence.measures, np.array(presence.measures.what)
    mine = np.flatnonzero((sizes.item == row) & (what != "distance"))
    counted = {sizes.what[k]: (sizes.value[k], sizes.sigma[k]) for k in mine.tolist()}
    surely = {sizes.what[k] for k in mine[sizes.changed[mine]].tolist()}
    if "displacement" in counted:
        (far, sigma), (turn, turn_sigma) = counted["displacement"], counted["turn"]
        along = ", ".join(f"{counted[name][0]:.1f}" for name in ("dx", "dy", "dz"))
        turned = f"turned by {turn:.1f} degrees, sigma {turn_sigma:.1g}; " if "turn" in surely else ""
        where = f"its middle lies {far:.1f} mm from its place, sigma {sigma:.1g}: {along} along x, y, z"
        return f"{path}: {state}, {turned}{where}"
    for k in mine[sizes.changed[mine] & (what[mine] != "offset")].tolist():
        words = f"{sizes.value[k]:.2f} mm, not {sizes.nominal[k]:.6g}, sigma {sizes.sigma[k]:.2g}"
        return f"{path}: {state}, {sizes.what[k]} {words}"
    if np.isfinite(presence.moved_mm[row]) and presence.state[row] == CHANGED:
        far, sigma = presence.moved_mm[row], presence.moved_sigma_mm[row]
        return f"{path}: {state}, a face of it lies {abs(far):.2f} mm {'out' if far > 0 else 'in'}, sigma {sigma:.2g}"
    return f"{path}: {state}, {REASONS[presence.reason[row]]}"


def tabulate(it: Presence) -> dict[str, dict[str, Any]]:
    """The rows of an assessment: of each of its tables the columns but the run and the placed part."""
    items, evidence, sizes, more = it.items, vars(it.evidence), it.measures, it.signs.unexplained
    count, cameras = it.evidence.log_odds.shape
    return {
        "presence": {
            "item_no": np.arange(count),
            **fields_of(items, "level path"),
            "feature_no": np.ma.masked_equal(items.feature_no, NONE),
            "surface_no": np.ma.masked_equal(items.surface_no, NONE),
            "state": [STATES[s] for s in it.state],
            "qif": [QIF[s] for s in it.state],
            "reason": [REASONS[r] for r in it.reason],
            **{name: values.sum(axis=1) for name, values in evidence.items()},
            "visible_pixels": items.visible_px,
            **fields_of(it, "moved_mm moved_sigma_mm moved_log_odds"),
        },
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


def describe(presence: Presence) -> dict[str, Any]:
    """Everything in plain lists and numbers, from its rows; items parts first, then features and surfaces."""
    rows = {name: _list_rows(columns) for name, columns in tabulate(presence).items()}
    items = rows["presence"]
    seen, sizes = defaultdict(list), defaultdict(list)
    for row in rows["presence_camera"]:
        seen[row["item_no"]].append(row)
    for row in rows["measured_size"]:
        sizes[row["item_no"]].append(row)
    return {
        "checked": {name: count_states(presence, name) for name in ("part", "feature", "surface")},
        "look_at": [presence.items.path[row] for row in rank_failures(presence).tolist()],
        "items": [
            {
                **{name: row[name] for name in ("path", "level", "state", "qif", "reason")},
                **_rounded(row, "log_odds expected_log_odds", 3),
                **_rounded(row, "visible_pixels edge_px distinct_px supported_px region_px", 1),
                "cameras": {
                    one["camera"]: _rounded(one, "log_odds", 3) | _rounded(one, "supported_px distinct_px region_px", 1)
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
                        "stopped": one["stopped"],
                    }
                    for one in seen[row["item_no"]]
                    if one["stopped"] is not None
                ],
            }
            for row in items
        ],
        "distances": [
            {
                "from": items[row["item_no"]]["path"],
                "to": items[row["other_item_no"]]["path"],
                **_rounded(row, _SIZE, 4),
                "changed": row["changed"],
            }
            for row in rows["measured_size"]
            if row["what"] == "distance"
        ],
        "unexplained": [
            {
                **{name: row[name] for name in ("camera", "kind", "image_arc_no", "region_no")},
                "box": [round(row[name], 1) for name in ("u0", "v0", "u1", "v1")],
                **_rounded(row, "length contrast", 1),
                "beyond": row["beyond"],
            }
            for row in rows["unexplained"]
        ],
    }


_SIZE = "nominal value sigma"


def _list_rows(columns: Mapping[str, Any]) -> list[dict[str, Any]]:
    plain = (np.ma.asarray(column).tolist() for column in columns.values())
    return [dict(zip(columns, row, strict=True)) for row in zip(*plain, strict=True)]


def _rounded(row: Mapping[str, Any], names: str, digits: int) -> dict[str, float]:
    """Some numbers of a row."""
    return {name: round(row[name], digits) for name in names.split()}


@dataclass(frozen=True)
class VariantEvidence:
    """What the pictures say of a variant in the place of the one that the world has there.

    object_no: of the world's object; placed: whether it is the world's; log_odds: the sum over its visible edges,
    each there against not there; against: how many of its features and parts in view differ from it; decided: how many
    are decided at all.  distinguished_by: paths, worst first, of those that differ from it, and that the
    likeliest variant has right or does not have.
    """

    object_no: int
    name: str
    variant: str
    object_variant_id: int
    placed: bool
    log_odds: float
    against: int
    decided: int
    distinguished_by: list[str]

    def to_json(self) -> dict[str, Any]:
        named = {"object": self.name, "variant": self.variant, "placed": self.placed}
        counted = {"log_odds": round(self.log_odds, 3), "against": self.against, "of": self.decided}
        return {**named, **counted, "distinguished_by": self.distinguished_by}


def assess_variant(
    variant: Mapping[str, Any], stored: StoredScene, seen: Observation, found: Localisation, p: PresenceParameters
) -> VariantEvidence:
    """The evidence for a variant, a row of `variants_in_world`, at the best pose; stored: the world with it in its
    place."""
    assert found.best is not None
    pose = found.best.world_from_rig
    view = view_model(stored.scene, found.rig, pose)
    parts = find_parts_in_view(stored, found.rig, view.maps, pose)
    return weigh_variant(variant, assess(stored, seen, found, view, parts, {}, p))


def weigh_variant(variant: Mapping[str, Any], presence: Presence) -> VariantEvidence:
    """The evidence for a variant from what is there and what is not at its place."""
    decided = (np.array(presence.items.level) != "surface") & (presence.state != UNDECIDABLE)
    failures = [presence.items.path[row] for row in rank_failures(presence).tolist()]
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
MOST_DISTINGUISHING = 5  # parts and features named, of those that distinguish two variants


def record_presence(write: Writer, stored: StoredScene, it: Presence) -> None:
    """Append all rows of an assessment; write: as `Run.writer`."""
    for table, columns in tabulate(it).items():
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
        distinguished_by=[", ".join(v.distinguished_by[:MOST_DISTINGUISHING]) or None for v in ranked],
    )
