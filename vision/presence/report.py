"""What is there and what is not, for people and programs: the worst first."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from relmodel.arrays import Ints
from vision.presence.measures import unit_of
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
)
from vision.presence.unexplained import KINDS, REGION

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
