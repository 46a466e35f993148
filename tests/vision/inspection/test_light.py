"""What a camera's response cannot be, in an inspection of blocks."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import relmodel
from tests.app.cli.conftest import Pair, copied
from vision.presence.states import assess


def test_sizes_err_by_what_was_solved_toward_the_bright_side(
    blocks_template: Path, blocks_pair: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A camera whose response is said to move edges a pixel to the bright side: they count as one without a response
    has them, and no size is known better than by that pixel."""
    sigmas: list[Any] = []

    def assess_in_light(stored: Any, seen: Any, found: Any, *given: Any) -> Any:
        for response in (0.0, -1.0):
            unknowns = found.best.camera_unknowns.copy()
            unknowns[:, 0] = response
            lit = replace(found, best=replace(found.best, camera_unknowns=unknowns))
            presence = assess(stored, seen, lit, *given)
            sigmas.append(presence.signs.surfaces.sigma)
        return presence

    monkeypatch.setattr("vision.inspection.inspection.assess", assess_in_light)
    with relmodel.open(copied(blocks_template)(tmp_path), read_only=False) as store:
        pictures = {"left": blocks_pair.left}
        store.inspect(rig=blocks_pair.rig_file, pictures=pictures, prior=blocks_pair.prior_file)
    usual, lit = sigmas
    known = np.isfinite(usual) & np.isfinite(lit)
    assert known.sum() > 3
    px = 350 / 520  # at least that many a mm
    assert (np.hypot(usual, 0.5 / px)[known] < lit[known]).all()
