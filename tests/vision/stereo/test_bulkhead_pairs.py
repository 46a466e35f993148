"""The methods on rendered brushed metal, without a model, against the exact places of visible edges and surfaces."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from tests.vision.stereo.rendered import find_region_siblings, find_siblings, read_pair
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.stereo.epipolar import pack_arcs
from vision.stereo.match import METHODS, match_stereo
from vision.stereo.stereo_parameters import DEFAULTS


@pytest.mark.data
@pytest.mark.parametrize(("part", "pair"), [("A", 4)])
def test_arcs_and_regions_on_metal_find_their_partners(data_dir: Path, part: str, pair: int) -> None:
    """Every arc along visible edges counts, level ones too, that has a partner of its size."""
    seen = read_pair(data_dir / "bulkhead" / part / "pairs", pair)
    left, right = (make_primitives(extract(picture)) for picture in seen.pictures.values())
    siblings = find_siblings(seen, pack_arcs(left), pack_arcs(right))
    regions = find_region_siblings(seen, left.regions, right.regions)
    for method in METHODS:
        found = match_stereo(seen.rig, left, right, parameters=replace(DEFAULTS, method=method))
        label = found.arc_label
        matched = np.flatnonzero(siblings.real & (label >= 0))
        good = siblings.right(matched, label[matched])
        recall = np.isin(np.flatnonzero(siblings.possible()), matched[good]).mean()
        region = np.flatnonzero(regions.known & (found.region_label >= 0))
        same = regions.right(region, found.region_label[region])
        print(f"{part}{pair} {method}: {good.mean():.3f} of {recall:.3f}, regions {same.mean():.3f} of {same.sum()}")
        assert good.mean() > (0.95 if method == "pong" else 0.85)
        assert recall > (0.8 if method == "pong" else 0.7)
        assert same.mean() > (0.8 if method == "pong" else 0.5)
        assert found.solved.result.bound <= found.solved.result.cost
