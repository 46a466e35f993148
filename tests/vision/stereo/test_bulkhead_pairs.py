"""The matcher on rendered brushed metal, against the exact places of visible edges in both pictures."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from tests.vision.stereo.rendered import depth_maps, find_siblings, read_pair
from vision.extraction.extract import extract
from vision.extraction.rows import make_primitives
from vision.stereo.crossings import pack_arcs
from vision.stereo.match import match_stereo


@pytest.mark.data
@pytest.mark.parametrize(("part", "pair"), [("A", 0), ("A", 5), ("C", 3)])
def test_arcs_on_metal_find_their_partners(data_dir: Path, part: str, pair: int) -> None:
    """Of arcs along visible edges, not along rows: how many matches are right, and of those that have a partner of
    their size, how many found it."""
    seen = read_pair(data_dir / "bulkhead" / part / "pairs", pair)
    left, right = (make_primitives(extract(picture)) for picture in seen.pictures.values())
    found = match_stereo(seen.rig, left, right, depth_maps(seen.depth, 60.0))
    siblings = find_siblings(seen, pack_arcs(left), pack_arcs(right))
    label = found.assignment.label
    matched = np.flatnonzero(siblings.real & (label >= 0))
    good = siblings.right(matched, label[matched])
    precision = good.mean()
    recall = np.isin(np.flatnonzero(siblings.possible() & found.left_votable), matched[good]).mean()
    print(f"{part}{pair}: precision {precision:.3f}, recall {recall:.3f}")
    assert found.assignment.cost == pytest.approx(found.assignment.bound, abs=1e-9)
    assert precision > 0.75
    assert recall > 0.75
