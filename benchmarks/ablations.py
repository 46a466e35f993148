"""What each part of the chain is worth: inspections with the join, the scan, or the account between rivals taken out.

    python -m benchmarks.ablations [--pairs N] [--sets A B C render_box photo_cube]

Of each bulkhead in the folder that RELMODEL_TEST_DATA names the first N pairs (default: all), with the prior `large` of
their truth and without one, and as many single pictures of bodies without circles, from priors some 10 mm and 3 degrees
off. `join off`: no relations of circles or straight edges start a pose; `scan off`: no prior's volume is scanned where
the join explains too little; `account off`: nothing tells rivals apart but the sum of edges. `right`: accepted within
.1 mm and .02 degrees of the truth, at a point 700 mm before the rig (of single pictures 5 mm and 2 degrees, as they
need); `wrong`: accepted and farther than 20 times that (twice); `decided`: items that are confirmed or differ."""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from itertools import islice
from math import radians
from pathlib import Path
from typing import Any
from unittest.mock import patch

import numpy as np
from tabulate import tabulate

from benchmarks.trials import Models, Trial, compute_error, find_data, inspect_trial, shared_bulkheads, single_pictures
from vision.cameras.cameras import DEFAULT_NEEDS, Needs
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters
from vision.localisation.hypotheses import Perturbations

HEADERS = ("set", "prior", "chain", "trials", "right", "wrong", "mm", "decided", "undecided", "cpu s")
CHAINS = ("whole", "join off", "scan off", "account off")
SINGLE = ("render_box", "photo_cube")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, metavar="N")
    parser.add_argument("--sets", nargs="+", default=["A", "B", "C", *SINGLE], metavar="SET")
    args = parser.parse_args(arguments)
    found: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        models = Models(Path(folder))
        for name in args.sets:
            for trial in read_set(find_data(), name, models, args.pairs):
                known = "large" if trial.prior is not None else "none"
                # Without a prior there is no volume to scan.
                for chain in CHAINS if trial.prior is not None else [c for c in CHAINS if c != "scan off"]:
                    one = measure(trial, models, chain)
                    found.setdefault((name, known, chain), []).append(one)
                    print(trial.name, known, chain, one, flush=True)
    print(tabulate([_summarise(*key, them) for key, them in found.items()], headers=HEADERS, floatfmt=".3f"))
    return 0


def read_set(data: Path, name: str, models: Models, count: int | None) -> Iterator[Trial]:
    """Pairs of a bulkhead, each with the prior `large` and without one, or every fourth picture of a body."""
    if name in SINGLE:
        yield from islice(single_pictures(data, name, models), 0, 4 * count if count else None, 4)
        return
    for trial in islice(shared_bulkheads(data, models, ("large",), name), count):
        yield trial
        yield replace(trial, prior=None)


def _summarise(name: str, prior: str, chain: str, found: list[dict[str, Any]]) -> tuple[Any, ...]:
    mm, degrees = (5.0, 2.0) if name in SINGLE else (0.1, 0.02)
    far = 2.0 if name in SINGLE else 20.0
    accepted = [one for one in found if one["verdict"] == "accepted"]
    right = sum(one["mm"] <= mm and one["degrees"] <= degrees for one in accepted)
    wrong = sum(one["mm"] > far * mm or one["degrees"] > far * degrees for one in accepted)
    off, cpu = (float(np.median([one[key] for one in found])) for key in ("mm", "cpu"))
    return (
        name,
        prior,
        chain,
        len(found),
        right,
        wrong,
        off,
        *(sum(o[n] for o in found) for n in ("decided", "open")),
        cpu,
    )


@contextmanager
def _chain(chain: str) -> Iterator[InspectionParameters]:
    """The parameters of a chain, which holds inside."""
    p = DEFAULTS.constellations
    if chain == "join off":
        yield replace(
            DEFAULTS,
            constellations=replace(
                p,
                join=replace(p.join, most=0),
                lines=replace(p.lines, most=0),
                one_picture=replace(p.one_picture, most=0),
            ),
        )
    elif chain == "scan off":
        nothing = Perturbations(np.zeros((0, 6)), np.zeros(0))
        with patch("vision.localisation.localise.search_poses", lambda *_: nothing):
            yield DEFAULTS
    elif chain == "account off":
        verdict = replace(DEFAULTS.localisation.verdict, most_told=0)
        yield replace(DEFAULTS, localisation=replace(DEFAULTS.localisation, verdict=verdict))
    else:
        yield DEFAULTS


def measure(trial: Trial, models: Models, chain: str) -> dict[str, Any]:
    """Verdict, error, how many parts and features are decided and open, and seconds of processor time."""
    needs = DEFAULT_NEEDS if trial.model.startswith("shared") else Needs(5.0, radians(2.0))
    with models.open(trial.model) as store, _chain(chain) as parameters:
        began = time.process_time()
        answer = inspect_trial(store, trial, models.folder, parameters, needs=needs, variants=False, keep_images=False)
        cpu = time.process_time() - began
        with store.read() as connection:
            states = store.columns(connection, "result/presence", run_id=answer.run)["state"].tolist()
    mm, degrees = compute_error(answer, trial.world_from_rig)
    undecided = sum(state in ("not_confirmed", "undecidable") for state in states)
    return {
        "verdict": answer.verdict, "mm": round(mm, 3), "degrees": round(degrees, 3),
        "decided": len(states) - undecided, "open": undecided, "cpu": round(cpu, 1),
    }  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
