"""Which predicted samples the pictures support, and how many would be supported by chance."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from relmodel.arrays import Bools, Floats, Ints
from vision.presence.presence_parameters import SupportParameters
from vision.presence.samples import Nearby, Samples


@dataclass(frozen=True)
class Support:
    """What supports the samples (n,).

    found: whether an edge element lies where the sample is; weight: px that it counts, zero on the picture's border and
    where a predicted edge of other surfaces lies so near that the picture cannot tell the two apart; chance: share of
    the places nearby, off all predicted edges, where an element lies as well; contrast: grey of the strongest that was
    found, 0 for none; owner: of each row of `Nearby` the sample nearest to its element, -1 where none lies within the
    tolerance.
    """

    found: Bools
    weight: Floats
    chance: Floats
    contrast: Floats
    owner: Ints


def measure_support(samples: Samples, nearby: Nearby, p: SupportParameters) -> Support:
    """The support by the elements near samples; an element supports the predicted edges of one surface only, the
    nearest.

    Edges that share a surface, as both rims of a bore in a thin web do, may share their elements, and so may the edges
    of a part that shows little, as the head of a bolt: they are present or absent together.
    """
    n, away = len(samples.run), np.abs(nearby.offset)
    elements = int(nearby.element.max(initial=-1)) + 1
    nearest = np.full(elements, np.inf)
    np.minimum.at(nearest, nearby.element, away)
    owner = np.zeros(elements, np.int64)
    first = away <= nearest[nearby.element]
    owner[nearby.element[first]] = nearby.sample[first]
    alien = ~share_surface(samples.kin[nearby.sample], samples.kin[owner[nearby.element]])
    claimed = alien & (nearest[nearby.element] < np.minimum(away - p.tie_px, p.tolerance_px))
    own = (away <= p.tolerance_px) & ~claimed
    found = np.zeros(n, bool)
    found[nearby.sample[own]] = True
    contrast = np.zeros(n)
    np.maximum.at(contrast, nearby.sample[own], nearby.contrast[own])

    # Chance: windows as wide as the tolerance, of what no predicted edge accounts for.
    free = nearest[nearby.element] > p.tolerance_px
    chance = np.zeros(n)
    for place in p.chance_px:
        seen = np.zeros(n, bool)
        seen[nearby.sample[free & (np.abs(nearby.offset - place) <= p.tolerance_px)]] = True
        chance += seen
    taken = np.where(nearest <= p.tolerance_px, owner, -1)[nearby.element]
    return Support(found, weigh_samples(samples, p), chance / len(p.chance_px), contrast, taken)


def weigh_samples(samples: Samples, p: SupportParameters) -> Floats:
    """The px (n,) that samples count where they are found, as in `Support`: no picture is needed to say."""
    return np.where(_are_crowded(samples, p) | ~samples.inside, 0.0, samples.length_px)


def share_surface(a: Ints, b: Ints) -> Bools:
    """Whether two samples (n, 2), (n, 2) lie on one surface."""
    return np.asarray(((a[:, :, None] == b[:, None, :]) & (a[:, :, None] >= 0)).any(axis=(1, 2)))


def _are_crowded(samples: Samples, p: SupportParameters) -> Bools:
    """Which samples lie too near to a nearly parallel predicted edge of other surfaces to be distinguished from it."""
    from scipy.spatial import cKDTree

    out = np.zeros(len(samples.run), bool)
    # A third coordinate beyond any picture's size keeps the cameras apart.
    at = np.column_stack([samples.pixel, 1e6 * samples.camera])
    i, j = cKDTree(at).query_pairs(p.crowded_px, output_type="ndarray").T
    other = samples.arc[i] != samples.arc[j]
    i, j = i[other], j[other]
    parallel = np.abs(np.einsum("ni,ni->n", samples.direction[i], samples.direction[j])) > p.crowded_cosine
    i, j = i[parallel], j[parallel]
    alien = ~share_surface(samples.kin[i], samples.kin[j])
    out[i[alien]] = out[j[alien]] = True
    return out
