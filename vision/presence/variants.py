"""Which loaded variant of an object the pictures show: the evidence for each at one pose, ranked."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from vision.localisation.localisation_parameters import LocalisationParameters
from vision.localisation.localise import Localisation
from vision.localisation.observation import Observation, view_model
from vision.localisation.parts_in_view import find_parts_in_view
from vision.presence.assess import assess
from vision.presence.presence_parameters import PresenceParameters
from vision.presence.report import count_against, rank_failures
from vision.presence.states import Presence
from vision.scene.stored_scene import StoredScene


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
