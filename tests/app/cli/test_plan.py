"""`relmodel plan` on the demonstration: what it says against what inspections of rendered pictures decided."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import relmodel
from relmodel.app.cli.main import main
from relmodel.app.cli.options import read_pairs
from relmodel.store import Store
from tests.app.cli.conftest import Pair, copied
from tests.app.cli.slider import BASE, carriage, carriage_from_rig
from tests.app.cli.test_findings import stop
from tests.given import Capsys
from vision.cameras.files import read_needs, read_prior
from vision.cameras.standpoints import read_standpoints
from vision.planning import plan_views


def test_a_carriage_proposes_where_it_goes_and_leaves_what_is_checked(
    bulkhead_template: Path, pair: Pair, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: Capsys
) -> None:
    target = copied(bulkhead_template)(tmp_path)
    call = ["plan", "--rig", str(pair.rig_file), "--store", target, "--format", "json"]
    assert main([*call, "--object", "bulkhead"]) == 0
    whole = json.loads(capsys.readouterr().out)
    checked = whole["views"][0]["checks"]
    assert len(checked) > 20
    for view in whole["views"]:
        pose = BASE @ carriage(view["joints"]["travel"]) @ carriage_from_rig(pair.prior["world_from_rig"])
        assert np.allclose(view["world_from_rig"], pose)
    shares = [view["share"] for view in whole["views"]]
    assert shares == sorted(shares)
    assert 0.95 <= shares[-1] <= 1

    made: dict[str, Any] = {}

    def plan_once(*given: Any) -> Any:
        wanted = str(sorted((name, it) for name, it in given[2].items() if it is not None))
        return made.get(wanted) or made.setdefault(wanted, plan_views(*given))

    monkeypatch.setattr("relmodel.app.propose.plan_views", plan_once)
    with Store.open(target) as store:
        stop(store, [(path.partition("/")[2], "confirmed", 9.0) for path in checked[:20]])
    assert main([*call[:-2], "--serial", "SN1", "--views", "2", "--out", str(tmp_path / "next")]) == 0
    said = capsys.readouterr()
    with relmodel.open(target) as python:
        rest = python.plan(rig=pair.rig_file, serial="SN1", views=2, out=tmp_path / "python").to_json()
    assert rest["left"] == whole["left"] - 20
    assert not set(checked[:20]) & {path for view in rest["views"] for path in view["checks"]}
    listed = read_pairs(tmp_path / "next/pairs.csv")
    assert [one.serial for one in listed] == ["SN1"] * len(rest["views"])
    for one, view in zip(listed, rest["views"], strict=True):
        assert np.allclose(read_prior(one.paths["prior"]).world_from_rig, view["world_from_rig"])
        assert read_needs(one.paths["prior"]) is None
        assert one.paths["rig"] == pair.rig_file.resolve()

    together = read_standpoints(tmp_path / "next/standpoints.csv")
    for stand, one, view in zip(together, listed, rest["views"], strict=True):
        assert stand.pictures == one.pictures
        np.testing.assert_allclose(stand.covariance, np.diag(np.repeat([5.0, np.radians(0.5)], 3) ** 2))
        np.testing.assert_allclose(stand.world_from_rig, view["world_from_rig"])  # type: ignore[arg-type]

    for file in (tmp_path / "next").iterdir():
        assert (tmp_path / "python" / file.name).read_text() == file.read_text()
    numbers = "".join(line[:6] for line in said.out.splitlines()[2:])
    assert numbers.split() == ["1", "2"]  # what a view checks may go over several lines
    count = sum(len(view["checks"]) for view in rest["views"])
    assert f"2 views would check {count} of {rest['left']} parts and features that are left" in said.err


@pytest.mark.parametrize(
    ("words", "sentence"),
    [
        (["--serial", "SN9"], "no inspection names the serial number SN9"),
        (["--object", "wing"], "has no inspected object wing"),
        (["--object", "bulkhead", "--views", "0"], "give at least 1"),
        (["--object", "bulkhead", "--distance", "-3"], "give mm above zero"),
    ],
)
def test_what_cannot_be_planned_is_refused(
    words: list[str], sentence: str, bulkhead_template: Path, pair: Pair, capsys: Capsys
) -> None:
    assert main(["plan", *words, "--rig", str(pair.rig_file), "--store", str(bulkhead_template)]) == 2
    assert sentence in capsys.readouterr().err
