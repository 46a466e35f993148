"""Damaged STEP files: one sentence each, and the store as it was."""

from __future__ import annotations

import re
from collections import Counter
from pathlib import Path

import numpy as np
import pytest
import sqlalchemy as sa

from relmodel.errors import InputError
from relmodel.loading.load import load as load_as_users_do
from relmodel.readers.step import part21
from relmodel.readers.step.part21 import Instances
from relmodel.store import Store
from tests.reading import load

# What a refused load may leave: the run, and why.
OF_RUNS = {"run", "run_input", "run_event", "load_report", "load_finding", "ledger"}


def counts(store: Store) -> dict[str, int]:
    """Rows of every table but those."""
    with store.read() as connection:
        names = [r.relation for r in connection.execute(store.table("sds_relation").select()) if r.standing != "view"]
        kept = [name for name in names if name not in OF_RUNS]
        rows = (sa.select(sa.literal(name), sa.func.count()).select_from(store.table(name)) for name in kept)
        return {name: int(count) for name, count in connection.execute(sa.union_all(*rows))}


def with_wrong_digits(text: bytes) -> bytes:
    """A cube's file with digits that let the kernel crash."""
    rng, out = np.random.default_rng([3, 0]), bytearray(text)
    digits = [m.start() for m in re.finditer(rb"[0-9]", text[text.index(b"DATA;") :])]
    for at in rng.choice(digits, int(rng.choice([1, 3, 10, 50])), replace=False).tolist():
        out[text.index(b"DATA;") + at] = ord("0") + int(rng.integers(10))
    return bytes(out)


@pytest.mark.data
def test_damaged_files_are_refused_in_a_sentence_and_leave_nothing(
    data_dir: Path, duckdb_file: Path, tmp_path: Path
) -> None:
    """Read by a child, as by users.  What is refused for lost faces loads in part where that is asked for."""
    cube = (data_dir / "step/cube-in.step").read_bytes()
    lost, crashing = tmp_path / "lost.step", tmp_path / "wrong.step"
    files = {
        tmp_path / "cut.step": (cube[: len(cube) // 2], "is cut off"),
        lost: (re.sub(rb"(ADVANCED_FACE.*?= )PLANE\(", rb"\1NONE(", cube, count=1, flags=re.DOTALL), "1 of 6 faces"),
        crashing: (with_wrong_digits(cube), r"crashed \(SIGSEGV\)"),
        data_dir / "damaged/select_segfault_2.stp": (None, "holds no face"),
        data_dir / "damaged/advanced-face-inline-cylinder-malformed.step": (None, "could not be read"),
    }
    with Store.open(duckdb_file) as store:
        before = counts(store)
        for path, (content, said) in files.items():
            if content is not None:
                path.write_bytes(content)
            with pytest.raises(InputError, match=said) as error:
                (load_as_users_do if path == crashing else load)(store, path, name="part", time_limit_s=30)
            assert error.value.exit_status == 3
            assert "\n" not in str(error.value)
            assert path.name in str(error.value)
            assert counts(store) == before
        report = load(store, lost, name="part", allow_partial=True)
        assert (report.status, report.faces_in_file, report.faces_loaded) == ("partial", 6, 5)
        assert report.message == "the file lists 6 faces and 5 were read"


def altered(path: Path, pattern: str, new: str, to: Path) -> Path:
    """A copy of a file with the first match of a pattern replaced."""
    text, count = re.subn(pattern, new, path.read_text("latin-1"), count=1)
    assert count == 1
    to.write_text(text, "latin-1")
    return to


@pytest.mark.data
@pytest.mark.parametrize(
    ("pattern", "new", "said"),
    [
        (r"#12 *=", "#999999=", "refers to #12, which it does not hold"),
        (r"#12 *=", "#12=NIL();#12=", "defines #12 more than once"),
        (r"#\d+ *= *CONTEXT_DEPENDENT_SHAPE_REPRESENTATION[^;]*;", "", "does not place 1 of 13 components"),
    ],
)
def test_damage_that_the_text_shows(data_dir: Path, tmp_path: Path, pattern: str, new: str, said: str) -> None:
    whole = data_dir / "step" / "as1-tu-203.stp"
    assert part21.damage(Instances(whole.read_bytes())) == ()
    damaged = altered(whole, pattern, new, tmp_path / "damaged.step")
    (finding,) = part21.damage(Instances(damaged.read_bytes()))
    assert (finding.kind, finding.message) == ("damaged_text", f"the file {said}")


@pytest.mark.data
def test_what_contradicts_itself_loads_with_findings(data_dir: Path, duckdb_file: Path, tmp_path: Path) -> None:
    """What the kernel reads with all its faces loads; what is wrong with it are rows, and --strict refuses it."""
    whole = data_dir / "step/cube-in.step"
    file = altered(whole, r"(#55 = CARTESIAN_POINT\('',\()0", r"\g<1>8", tmp_path / "cube.step")
    with Store.open(duckdb_file) as store:
        with pytest.raises(InputError, match=r"finding.*, the first: .*without --strict"):
            load(store, file, name="part", strict=True)
        report = load(store, file, name="part")
        assert report.status == "added"
        with store.read() as connection:
            rows = connection.execute(store.table("load_finding").select()).all()
            arcs = {row.id for row in connection.execute(store.table("arc").select())}
    ours, refused = [r for r in rows if r.run_id == report.run], [r for r in rows if r.run_id != report.run]
    assert [(r.kind, r.message, r.value) for r in ours] == [(r.kind, r.message, r.value) for r in refused]
    assert dict(report.findings) == Counter(r.kind for r in ours)
    worst = max((r for r in ours if r.kind == "edge_off_face"), key=lambda r: r.value)
    assert (worst.value, worst.bound) == pytest.approx((203.2, 0.17320508), rel=1e-3)
    assert {r.arc_id for r in ours if r.kind in ("open_loop", "edge_off_face")} <= arcs
