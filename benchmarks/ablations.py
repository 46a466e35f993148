"""What each part of the chain is worth: inspections with the join, the matcher or the scan taken out.

    python -m benchmarks.ablations [--pairs N] [--parts A B C]

Of each bulkhead in the folder that RELMODEL_TEST_DATA names the first N pairs (default: all), with the prior `large` of
their truth and without one.  `scan off`: poses of the join alone go on, however little they explain; `matcher off`:
presence does not know which regions of the pictures match which surfaces.  `right`: accepted within .1 mm and .02
degrees of the truth, at a point 700 mm before the rig; `wrong`: accepted and beyond 2 mm or .2 degrees; `decided`:
parts, features and surfaces that are confirmed or found to differ.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace
from inspect import signature
from math import sqrt
from pathlib import Path
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import yaml
from tabulate import tabulate

from benchmarks.without_prior import compute_errors, place_part, read_truths, write_rig
from relmodel.store import Store
from vision.inspection import inspect
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters
from vision.presence.assess import assess

HEADERS = ("prior", "chain", "pairs", "right", "wrong", "mm", "decided", "undecided", "cpu s")
CHAINS = ("whole", "join off", "scan off", "matcher off")


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, metavar="N")
    parser.add_argument("--parts", nargs="+", default=["A", "B", "C"], metavar="PART")
    args = parser.parse_args(arguments)
    data = os.environ.get("RELMODEL_TEST_DATA")
    if not data:
        sys.exit("set RELMODEL_TEST_DATA to the folder of the test data")
    found: dict[tuple[str, str], list[dict[str, Any]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for part in args.parts:
            store_file = Path(folder) / f"{part}.duckdb"
            place_part(store_file, Path(data) / "bulkhead" / part)
            for truth in read_truths(Path(data) / "bulkhead" / part)[: args.pairs]:
                for prior in ("large", "none"):
                    for chain in CHAINS:
                        one = _inspect(store_file, truth, prior, chain)
                        found.setdefault((prior, chain), []).append(one)
                        print(part, truth["pair"], prior, chain, one, flush=True)
    print(tabulate([_summarise(*key, them) for key, them in found.items()], headers=HEADERS, floatfmt=".3f"))
    return 0


def _summarise(prior: str, chain: str, found: list[dict[str, Any]]) -> tuple[Any, ...]:
    right = sum(one["verdict"] == "accepted" and one["mm"] <= 0.1 and one["degrees"] <= 0.02 for one in found)
    wrong = sum(one["verdict"] == "accepted" and (one["mm"] > 2 or one["degrees"] > 0.2) for one in found)
    mm, cpu = (float(np.median([one[name] for one in found])) for name in ("mm", "cpu"))
    return prior, chain, len(found), right, wrong, mm, *(sum(one[n] for one in found) for n in ("decided", "open")), cpu


@contextmanager
def _chain(chain: str) -> Iterator[InspectionParameters]:
    """The parameters of a chain, which holds inside."""
    p = DEFAULTS.constellations
    if chain == "join off":
        yield replace(DEFAULTS, constellations=replace(p, join=replace(p.join, most=0)))
    elif chain == "scan off":
        yield replace(DEFAULTS, constellations=replace(p, poses=replace(p.poses, enough=0.0)))
    elif chain == "matcher off":
        matched = list(signature(assess).parameters).index("matched")

        def assess_without(*given: Any) -> Any:
            return cast(Any, assess)(*given[:matched], {}, *given[matched + 1 :])

        with patch("vision.inspection.inspection.assess", assess_without):
            yield DEFAULTS
    else:
        yield DEFAULTS


def _inspect(store_file: Path, truth: dict[str, Any], prior: str, chain: str) -> dict[str, Any]:
    """Verdict, error, how many parts and features are decided and open, and seconds of processor time."""
    stated = truth["priors"].get(prior)
    file = None
    if stated is not None:
        sigma = {"translation_mm": stated["mm"] / sqrt(3), "rotation_deg": stated["deg"] / sqrt(3)}
        file = store_file.with_name("prior.yaml")
        file.write_text(yaml.safe_dump({"world_from_rig": stated["T_world_cam_left"], "sigma": sigma}))
    left, right = (f"{truth['stem']}_{side}.png" for side in ("left", "right"))
    rig = write_rig(store_file.with_name("rig.yaml"), truth)
    with Store.open(store_file) as store, _chain(chain) as parameters:
        began = time.process_time()
        answer = inspect(
            store, rig=rig, left=left, right=right, prior=file, variants=False, parameters=parameters, keep_images=False
        )
        cpu = time.process_time() - began
        with store.read() as connection:
            states = store.columns(connection, "result/presence", run_id=answer.run)["state"].tolist()
    mm, degrees = np.inf, np.inf
    if answer.world_from_rig is not None:
        true = np.array(truth["cameras"]["left"]["T_world_cam"])
        (mm,), (degrees,) = compute_errors(answer.world_from_rig[None], true)
    undecided = sum(state in ("not_confirmed", "undecidable") for state in states)
    return {
        "verdict": answer.verdict, "mm": round(float(mm), 3), "degrees": round(float(degrees), 3),
        "decided": len(states) - undecided, "open": undecided, "cpu": round(cpu, 1),
    }  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
