"""Damaged copies of STEP files, and what loading one into a store comes to."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import sqlalchemy as sa

from relmodel.errors import InputError
from relmodel.loading.load import load
from relmodel.store import Store
from relmodel.store.check import check

KINDS = ("truncation", "byte flips", "dropped lines", "digit noise")

# What a refused load may leave: the run, and why.
OF_RUNS = {"run", "run_input", "run_event", "load_report", "load_finding", "ledger"}

# Sentences of a refusal, and what they show.
_REFUSALS = {
    "before the kernel": ("is not a STEP file", "is cut off", "holds no face", "not a finite number"),
    "kernel failed": ("could not be read", "kernel does not start", "unit of length"),
    "child killed": ("crashed",),
    "over a limit": ("was stopped", "GB of memory: split"),
    "lost faces": ("were lost on reading",),
    "not finite": ("that are not finite",),
}

_DIGIT = re.compile(rb"[0-9]")


@dataclass(frozen=True)
class Outcome:
    """What became of one load.  faults: what must not be; empty where all is well."""

    outcome: str
    said: str
    faults: tuple[str, ...]


def damaged(text: bytes, kind: str, seed: int) -> bytes:
    """A copy of a file's text, damaged in one of KINDS; equal seeds give equal copies."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    if kind == "truncation":
        return text[: int(len(text) * rng.uniform(0.02, 0.999))]
    if kind == "byte flips":
        out = bytearray(text)
        for at in rng.choice(len(out), int(rng.choice([1, 3, 10, 100])), replace=False).tolist():
            out[at] ^= 1 << int(rng.integers(8))
        return bytes(out)
    if kind == "dropped lines":
        lines = text.splitlines(keepends=True)
        gone = set(rng.choice(len(lines), min(len(lines) // 2, int(rng.choice([1, 2, 5, 20]))), replace=False).tolist())
        return b"".join(line for i, line in enumerate(lines) if i not in gone)
    out = bytearray(text)
    digits = [m.start() for m in _DIGIT.finditer(text, text.index(b"DATA;"))]
    for at in rng.choice(digits, int(rng.choice([1, 3, 10, 50])), replace=False).tolist():
        out[at] = ord("0") + int(rng.integers(10))
    return bytes(out)


def load_damaged(store: Store, path: Path, *, allow_partial: bool, time_limit_s: float) -> Outcome:
    """Load a damaged file and find fault with what must not be, whatever the damage."""
    before = _counts(store)
    faults = []
    try:
        report = load(store, path, name=path.stem, allow_partial=allow_partial, time_limit_s=time_limit_s)
        whole = "loaded with findings" if report.findings else "loaded whole"
        outcome, said = ("loaded in part" if report.status == "partial" else whole), report.message or ""
        if outcome == "loaded in part" and not allow_partial:
            faults.append("loaded in part, unasked")
        if report.faces_in_file is not None and report.faces_loaded < report.faces_in_file and not said:
            faults.append("lost faces in silence")
        if outcome != "loaded in part":
            faults += sorted({f"fails the check {f.query}" for f in check(store) if f.rows})
    except InputError as error:
        said = str(error)
        outcome = next((o for o, signs in _REFUSALS.items() if any(sign in said for sign in signs)), "other")
        if error.exit_status != 3:
            faults.append(f"exit status {error.exit_status}")
        if "\n" in said or ": " not in said or path.name not in said:
            faults.append(f"no clear sentence: {said}")
        after = _counts(store)
        changed = sorted(name for name in after if after[name] != before[name] and name not in OF_RUNS)
        if changed:
            faults.append(f"refused, and yet rows were added to {', '.join(changed)}")
    except Exception as error:
        outcome, said = "other", f"{type(error).__name__}: {error}"
        faults.append(f"not an InputError: {said[:200]}")
    return Outcome(outcome, said, tuple(faults))


def _counts(store: Store) -> dict[str, int]:
    """Rows of every table."""
    with store.read() as connection:
        names = [r.relation for r in connection.execute(store.table("sds_relation").select()) if r.standing != "view"]
        counts = (sa.select(sa.literal(name), sa.func.count()).select_from(store.table(name)) for name in names)
        return {name: int(count) for name, count in connection.execute(sa.union_all(*counts))}
