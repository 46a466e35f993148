"""`relmodel why` and `relmodel compare`: what they say of an inspection, compared with its rows and its answer."""

from __future__ import annotations

import json
import re
from pathlib import Path

import numpy as np
import pytest

from relmodel.app.audit import Difference, compare_runs, explain
from relmodel.app.cli.main import main
from relmodel.errors import UsageError
from relmodel.geometry.transforms import rotation_matrix
from relmodel.store import Store
from tests.app.cli.conftest import Inspection, asked
from tests.given import Capsys


@pytest.fixture(scope="module", params=["inspection", "postgresql_inspection"], ids=["duckdb", "postgresql"])
def of_engine(request: pytest.FixtureRequest) -> Inspection:
    found: Inspection = request.getfixturevalue(request.param)
    return found


def test_each_arc_has_one_decision_and_a_sentence(of_engine: Inspection) -> None:
    run = of_engine.answer["run"]
    with Store.open(of_engine.store, read_only=True) as store:
        decided = asked(store, "SELECT * FROM why_image_arc WHERE run_id = :run", run=run)
        listed = "SELECT camera, image_arc_no FROM inspection_image JOIN image_arc USING (extraction_id)"
        arcs = asked(store, f"{listed} WHERE run_id = :run", run=run)
        assert sorted((r.camera, r.image_arc_no) for r in decided) == sorted(map(tuple, arcs))
        taken = asked(store, "SELECT camera, image_arc_no FROM matched_arc WHERE run_id = :run", run=run)
        assert {(r.camera, r.image_arc_no) for r in decided if r.matched} == {tuple(r) for r in taken}
        assert all(r.sentence and r.rule for r in decided)
        of_model = "SELECT count(*) FROM {} WHERE run_id = :run"
        why, whole = (asked(store, of_model.format(it), run=run) for it in ("why_view_arc", "view_arc"))
        assert why == whole
        account = asked(
            store,
            "SELECT sum(a.supported_px), p.supported_px FROM view_arc AS a JOIN presence AS p ON p.run_id = a.run_id"
            " AND p.occurrence_id = a.occurrence_id AND p.level = 'part' GROUP BY p.item_no, p.supported_px",
        )
        assert [of_arcs for of_arcs, _ in account] == pytest.approx([of_part for _, of_part in account])
        camera, arc = next((r.camera, r.image_arc_no) for r in decided if r.matched)
        said = explain(store, run, arc=f"{camera}:{arc}")
        assert said[0].sentence.startswith(f"image arc {arc} of the {camera} picture is ")
        assert said[1].topic == "correspondence"
        assert said[1].sentence.startswith("it is the ")
        assert re.search(r"they are \d+\.\d\d px \(rms\) apart \(gate \d+\.\d\d px\)", said[1].sentence)
        assert [one.topic for one in said].count("stereo") == 1


def test_verdict_pose_and_parts_are_explained(inspection: Inspection) -> None:
    answer = inspection.answer
    with Store.open(inspection.store, read_only=True) as store:
        verdict = explain(store, answer["run"])
        assert [one.sentence for one in verdict[:2]] == [
            f"run {answer['run']}: {answer['outcome']['words']}",
            f"the pose is {answer['verdict']}: {answer['reason']}",
        ]
        rules = [one.sentence for one in verdict if one.topic == "rules"]
        assert len(rules) == 9
        assert all(rule.startswith("passed") for rule in rules)
        assert f"known to {2 * answer['sigma']['translation_mm']:.3f} mm (two sigma" in rules[3]
        pose = " ".join(one.sentence for one in explain(store, answer["run"], pose=True))
        assert all(f"{value:.3f}" in pose for value in np.array(answer["world_from_rig"])[:3, 3])
        shares = {part["path"]: part["visible_share"] for part in answer["parts_in_view"]}
        for item in [item for item in answer["presence"]["items"] if item["path"] in shares][::15]:
            said = explain(store, answer["run"], feature=item["path"])
            assert f"{item['path']} ({item['level']}) is in view" in said[0].sentence
            shown = float(re.search(r"([\d.]+) percent of what", said[0].sentence)[1])  # type: ignore[index]
            assert shown == pytest.approx(100 * shares[item["path"]], abs=0.06)
            (state, *of_cameras) = (one.sentence for one in said if one.topic == "presence")
            assert f"it is {item['state'].replace('_', ' ')} ({item['qif']}): {item['reason']}" in state
            assert len(of_cameras) == len(item["cameras"])
            sizes = [one.sentence for one in said if one.topic == "sizes"]
            assert [size.split()[1] for size in sizes] == [f"{size['what']}:" for size in item["measured"]]


def test_what_there_is_not_is_wrong_use(inspection: Inspection, capsys: Capsys) -> None:
    for words, says in (
        ("99", "there is no run 99"),
        ("1", "run 1 is of kind"),
        ("last --arc 17", "is not CAMERA:NUMBER"),
        ("last --arc mid:1", "has no camera mid: name one of left, right"),
        ("last --arc left:99999", "has no arc 99999: it has arcs 0 to "),
        ("last --feature bulkhead/BODI", "did you mean bulkhead/BODY?"),
    ):
        assert main(["why", *words.split(), "--store", inspection.store]) == 2
        said = capsys.readouterr().err
        assert (says in said, said.count("\n")) == (True, 1), said


def by_name(found: list[Difference], section: str) -> dict[str, Difference]:
    return {one.name: one for one in found if one.section == section}


def test_a_run_is_named_alike_everywhere(blocks_seen: Inspection, tmp_path: Path, capsys: Capsys) -> None:
    run, page = str(blocks_seen.answer["run"]), ["-o", str(tmp_path / "page.html")]

    def said(*words: str, status: int = 0) -> tuple[str, str]:
        assert main([*words, "--store", blocks_seen.store]) == status
        return capsys.readouterr()

    assert len({said("why", *name) for name in ([], ["last"], ["--run", run])}) == 1
    assert said("replay", "1", status=2) == said("replay", "--run", "1", status=2)  # a load
    for call in (["why"], ["replay", "--run"], ["report", *page], ["prune", "runs", "--run"], ["compare", run]):
        assert said(*call, "first", status=2)[1].endswith(": first names no run: give its number, or last\n")


def test_runs_that_differ_in_nothing_and_in_what_was_asked(
    inspection: Inspection, left_alone: Inspection, capsys: Capsys, monkeypatch: pytest.MonkeyPatch
) -> None:
    target, answer, other = left_alone.store, inspection.answer, left_alone.answer
    a, b = answer["run"], other["run"]
    with Store.open(target, read_only=True) as store:
        assert compare_runs(store, a, a) == []
        with pytest.raises(UsageError, match="there is no run 99"):
            compare_runs(store, a, 99)
        found = compare_runs(store, a, b)
    assert set(by_name(found, "inputs")) == {"right"}
    assert set(by_name(found, "asked")) == {"needs"}
    # Fewer cameras see fewer parts: they part where the parts are selected, or where the pictures are looked at.
    (first,) = (one for one in found if one.section == "first step that differs")
    assert first.name == ("select" if by_name(found, "select") else "extract")
    shares, shares_b = ({p["path"]: p["visible_share"] for p in it["parts_in_view"]} for it in (answer, other))
    differ = {path for path in shares | shares_b if shares.get(path) != shares_b.get(path)}
    assert set(by_name(found, "view")) == differ

    pose, pose_b = np.array(answer["world_from_rig"]), np.array(other["world_from_rig"])
    rig = by_name(found, "pose in the rig")
    along = np.array([rig[f"shift along {axis}, mm"].difference for axis in "xyz"])
    turn = np.array([rig[f"turn about {axis}, rad"].difference for axis in "xyz"])
    carried = np.eye(4)
    carried[:3, :3], carried[:3, 3] = rotation_matrix(turn), along
    np.testing.assert_allclose(pose @ carried, pose_b, atol=1e-9)
    variance = sum(np.array(one["covariance"])[0, 0] for one in (answer, other))
    assert rig["shift along x, mm"].sigma == pytest.approx(np.sqrt(variance))

    def said(*words: str) -> list[str]:
        assert main(["compare", str(a), str(b), *words, "--store", target]) == 0
        return capsys.readouterr().out.splitlines()

    # How it is printed; of the runs the other way about there is nothing.
    monkeypatch.setattr("relmodel.app.audit.compare_runs", lambda _, *runs: found if runs == (a, b) else [])
    assert [Difference(**row) for row in json.loads("\n".join(said("--json")))] == found
    assert len(said("--md")) == len(said("--all")) == len(found) + 2
    lines = said()
    assert max(map(len, lines)) <= 100
    sizes = [len([one for one in found if one.section == name]) for name in {one.section for one in found}]
    left_out = sum(map(int, re.findall(r"\.\.\. and (\d+) more:\s+--all", "\n".join(lines))))
    assert left_out == sum(max(0, size - 6) for size in sizes) > 0
