"""What is lost when a part of the chain is taken out, on a few pictures: `benchmarks.ablations` runs it on all."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks.ablations import inspect_case, pairs, single_pictures

pytestmark = pytest.mark.data


def test_without_the_join_no_pose_and_without_the_matcher_fewer_states(data_dir: Path, tmp_path: Path) -> None:
    (without_prior,) = (case for case in pairs(data_dir, "A", tmp_path, 1) if case.prior is None)
    whole, unmatched, unjoined = (inspect_case(without_prior, c) for c in ("whole", "matcher off", "join off"))
    assert whole["verdict"] == "accepted"
    assert whole["mm"] < 0.1
    assert unmatched["decided"] < whole["decided"]
    assert unjoined["verdict"] == "refused"


def test_a_body_without_circles_is_found_by_the_scan_alone(data_dir: Path, tmp_path: Path) -> None:
    (case,) = single_pictures(data_dir, "render_box", tmp_path, 1)
    whole, unjoined, unscanned = (inspect_case(case, c) for c in ("whole", "join off", "scan off"))
    assert whole["verdict"] == unjoined["verdict"] == "accepted"
    assert max(whole["mm"], unjoined["mm"]) < 5.0
    assert unscanned["verdict"] == "refused"
