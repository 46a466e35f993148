"""`relmodel rig check` on the demonstration's rig."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest

from relmodel.app.cli.main import main
from tests.app.cli.conftest import Pair
from tests.given import Capsys


def test_a_good_rig_and_its_pictures(pair: Pair, capsys: Capsys) -> None:
    pictures = [f"left={pair.left}", f"right={pair.right}"]
    assert main(["rig", "check", str(pair.rig_file), "--distance", "900", *pictures]) == 0
    said = capsys.readouterr().out
    assert "at 900 mm: left 1.21 mm a pixel, right 1.21 mm a pixel" in said
    assert "220 mm apart, axes 10.9 degrees to each other" in said
    assert "lie within 2 px of where the file has them" in said
    assert "was calibrated" not in said


@pytest.mark.parametrize("distance", ["0", "-3", "inf"])
def test_a_distance_that_is_none(distance: str, pair: Pair, capsys: Capsys) -> None:
    assert main(["rig", "check", str(pair.rig_file), f"--distance={distance}"]) == 2
    assert "give --distance MM above zero" in capsys.readouterr().err
    assert main(["rig", "check", str(pair.rig_file), "--unit", "m"]) == 2  # not ignored in silence


def test_what_is_looked_at_is_an_object_of_the_world_or_what_a_prior_shows(
    bulkhead_template: Path, pair: Pair, capsys: Capsys
) -> None:
    def checked(*options: str) -> dict[str, Any]:
        assert (
            main(["rig", "check", str(pair.rig_file), *options, "--store", str(bulkhead_template), "--format", "json"])
            == 0
        )
        found: dict[str, Any] = json.loads(capsys.readouterr().out)
        return found

    near, far = (checked("--object", "bulkhead", "--distance", mm) for mm in ("900", "1800"))
    # As far as what is seen of it lies, its corners farther than its middle.
    assert 900 < near["distance_mm"] < 1050
    assert 1800 < far["distance_mm"] < 2100
    assert near["sigma_mm"] < 0.5 * far["sigma_mm"]
    seen = checked("--prior", str(pair.prior_file))
    assert 800 < seen["distance_mm"] < 1000
    ask = ["rig", "check", str(pair.rig_file), "--store", str(bulkhead_template)]
    for name in ("nut", "slider"):  # the slider only stands there
        assert main([*ask, "--object", name]) == 3
        assert f"has no inspected object {name}: it has bulkhead" in capsys.readouterr().err
    assert main([*ask, "--object", "bulkhead", "--prior", str(pair.prior_file)]) == 2
