"""Log odds of found shares, against sums over the binomial distribution and what they must do."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.stats import betabinom

from vision.presence.presence_parameters import RunParameters
from vision.presence.stretches import compute_log_odds

P = RunParameters()


@pytest.mark.parametrize(("found", "n", "chance", "share"), [(9, 10, 0.1, 0.8), (1, 10, 0.1, 0.8), (3, 4, 0.3, 0.5)])
def test_log_odds_are_those_of_mixtures_of_beta_binomials(found: int, n: int, chance: float, share: float) -> None:
    shown = betabinom.pmf(found, n, *P.shown)
    partly = betabinom.pmf(found, n, 1, 1)
    nothing = betabinom.pmf(found, n, P.chance_count * chance, P.chance_count * (1 - chance))
    there = share * shown + (1 - share) * (P.partly * partly + (1 - P.partly) * nothing)
    odds = np.log(there / ((1 - P.stray) * nothing + P.stray * partly))
    one = np.ones(1)
    got = compute_log_odds(found / n * one, n * one, chance * one, share * one, P)
    assert got == pytest.approx([odds])


def test_what_is_expected_to_be_faint_says_little_where_it_is_missing() -> None:
    n, chance = np.full(3, 8.0), np.full(3, 0.1)
    odds = compute_log_odds(np.zeros(3), n, chance, np.array([0.1, 0.6, 0.95]), P)
    assert (np.diff(odds) < 0).all()
    assert -0.5 < odds[0] < 0
    assert odds[2] < -1.5


def test_no_length_says_nothing() -> None:
    one = np.ones(1)
    assert compute_log_odds(0.5 * one, 1e-9 * one, 0.1 * one, 0.8 * one, P) == pytest.approx([0.0], abs=1e-6)
