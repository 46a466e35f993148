"""The sentences of a verdict, by numbers given by hand."""

from __future__ import annotations

import numpy as np
import pytest

from vision.cameras.cameras import Needs
from vision.localisation.localisation_parameters import DEFAULTS
from vision.localisation.verdict import Gathered, judge


@pytest.mark.parametrize(("found", "accepted"), [(1.013, True), (1.013, False), (0.4, False)])
def test_no_more_is_found_than_is_expected_and_zero_has_no_sign(found: float, accepted: bool) -> None:
    one = np.ones(1)
    evidence = 2000.0 if accepted else 1.0
    gathered = Gathered(
        prior_sigma=one, evidence=evidence * one, found=1e3 * found * one, expected=1e3 * one, outline_px=105 * one,
        outline_contrast=-0.04 * one, outline_evidence=0 * one,
    )  # fmt: skip
    verdict = judge(gathered, np.array([0]), 0.9, [], (0.01, 1e-5, "x"), 0, Needs(1.0, 0.01), DEFAULTS.verdict)
    assert (verdict.verdict == "accepted") is accepted
    assert f"{min(round(100 * found), 100)}% of the" in verdict.reason
    assert accepted or "contrast of 0.0 along 105 px" in verdict.reason
