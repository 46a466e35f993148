"""What each part of the chain is worth: inspections with the join, the matcher or the scan taken out.

    python -m benchmarks.ablations [--pairs N] [--sets A B C render_box photo_cube]

Of each bulkhead in the folder that RELMODEL_TEST_DATA names the first N pairs (default: all), with the prior `large` of
their truth and without one, and as many single pictures of bodies without circles, from priors some 10 mm and 3 degrees
off.  `join off`: no relations of circles or straight edges start a pose; `scan off`: no prior's volume is scanned where
the join explains too little; `matcher off`: nothing tells rivals apart but edges, and presence does not know which
regions of the pictures match which surfaces.  `right`: accepted within .1 mm and .02 degrees of the truth, at a point
700 mm before the rig (of single pictures 5 mm and 2 degrees, as they need); `wrong`: accepted and farther than 20 times
that (twice); `decided`: parts, features and surfaces that are confirmed or found to differ.
"""

from __future__ import annotations

import argparse
import json
import os
import sys
import tempfile
import time
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from inspect import signature
from math import radians, sqrt
from pathlib import Path
from typing import Any, cast
from unittest.mock import patch

import numpy as np
import yaml
from tabulate import tabulate

from benchmarks.trials import draw_prior
from benchmarks.without_prior import compute_errors, place_part, read_truths, write_rig
from relmodel.arrays import Floats
from relmodel.geometry.transforms import inverse
from relmodel.loading.load import load
from relmodel.store import Store
from relmodel.world.placement import place_world
from vision.cameras.cameras import DEFAULT_NEEDS, Needs, Prior
from vision.cameras.images import read_picture
from vision.inspection import Task, inspect
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters
from vision.localisation.hypotheses import Perturbations
from vision.presence.states import assess

HEADERS = ("set", "prior", "chain", "trials", "right", "wrong", "mm", "decided", "undecided", "cpu s")
CHAINS = ("whole", "join off", "scan off", "matcher off")
SINGLE = ("render_box", "photo_cube")


@dataclass(frozen=True)
class Case:
    """Pictures of a set by camera, what the rig file says, where the rig is thought to be, and where it is."""

    name: str
    store: Path
    cameras: dict[str, Any]
    pictures: dict[str, Path]
    prior: Prior | None
    world_from_rig: Floats
    needs: Needs = DEFAULT_NEEDS


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pairs", type=int, metavar="N")
    parser.add_argument("--sets", nargs="+", default=["A", "B", "C", *SINGLE], metavar="SET")
    args = parser.parse_args(arguments)
    data = os.environ.get("RELMODEL_TEST_DATA")
    if not data:
        sys.exit("set RELMODEL_TEST_DATA to the folder of the test data")
    found: dict[tuple[str, str, str], list[dict[str, Any]]] = {}
    with tempfile.TemporaryDirectory() as folder:
        for name in args.sets:
            cases = single_pictures if name in SINGLE else pairs
            for case in cases(Path(data), name, Path(folder), args.pairs):
                known = "large" if case.prior is not None else "none"
                # Without a prior there is no volume to scan.
                for chain in CHAINS if case.prior is not None else [c for c in CHAINS if c != "scan off"]:
                    one = inspect_case(case, chain)
                    found.setdefault((name, known, chain), []).append(one)
                    print(case.name, known, chain, one, flush=True)
    print(tabulate([_summarise(*key, them) for key, them in found.items()], headers=HEADERS, floatfmt=".3f"))
    return 0


def pairs(data: Path, part: str, folder: Path, count: int | None) -> Iterator[Case]:
    """Pairs of a bulkhead, each with the prior `large` and without one."""
    store = folder / f"{part}.duckdb"
    place_part(store, data / "bulkhead" / part)
    for truth in read_truths(data / "bulkhead" / part)[:count]:
        cameras = yaml.safe_load(write_rig(folder / "rig.yaml", truth).read_text())
        pictures = {side: Path(f"{truth['stem']}_{side}.png") for side in ("left", "right")}
        stated = truth["priors"]["large"]
        sigma = (stated["mm"] / sqrt(3), radians(stated["deg"] / sqrt(3)))
        for prior in (Prior.isotropic(np.array(stated["T_world_cam_left"], float), *sigma), None):
            true = np.array(truth["cameras"]["left"]["T_world_cam"])
            yield Case(f"{part}{truth['pair']}", store, cameras, pictures, prior, true)


def single_pictures(data: Path, name: str, folder: Path, count: int | None) -> Iterator[Case]:
    """Every fourth picture of a folder with `frames.json` and `model.obj`."""
    store, described = folder / f"{name}.duckdb", json.loads((data / name / "frames.json").read_text())
    (folder / "world.yaml").write_text("world: cell\nobjects: [{object: model}]\n")
    with Store.create(store) as made:
        load(made, data / name / "model.obj", name="model", unit=described.get("unit", "mm"))
        place_world(made, folder / "world.yaml")
    for number, frame in enumerate(described["frames"][::4][:count]):
        picture, true = (
            read_picture(data / name / frame["image"]),
            inverse(np.array(frame["camera_from_object"], float)),
        )
        camera = {"width": picture.width, "height": picture.height, "matrix": frame["K"]}
        cameras = {"cameras": {"left": camera | {"rig_from_camera": np.eye(4).tolist()}}}
        prior = draw_prior(true, 10 / sqrt(3), 3 / sqrt(3), (2, number))
        needs = Needs(5.0, radians(2.0))
        yield Case(frame["image"], store, cameras, {"left": data / name / frame["image"]}, prior, true, needs)


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
    elif chain == "matcher off":
        verdict = replace(DEFAULTS.localisation.verdict, most_related=0)
        matched = list(signature(assess).parameters).index("matched")

        def assess_without(*given: Any) -> Any:
            return cast(Any, assess)(*given[:matched], {}, *given[matched + 1 :])

        with patch("vision.inspection.inspection.assess", assess_without):
            yield replace(DEFAULTS, localisation=replace(DEFAULTS.localisation, verdict=verdict))
    else:
        yield DEFAULTS


def inspect_case(case: Case, chain: str) -> dict[str, Any]:
    """Verdict, error, how many parts and features are decided and open, and seconds of processor time."""
    rig, prior = case.store.with_name("rig.yaml"), case.store.with_name("prior.yaml")
    rig.write_text(yaml.safe_dump(case.cameras))
    if case.prior is not None:
        stated = {"world_from_rig": case.prior.world_from_rig.tolist(), "covariance": case.prior.covariance.tolist()}
        prior.write_text(yaml.safe_dump(stated))
    with Store.open(case.store) as store, _chain(chain) as parameters:
        began = time.process_time()
        given = None if case.prior is None else prior
        task = Task(rig=rig, pictures=case.pictures, prior=given, needs=case.needs, variants=False, keep_images=False)
        answer = inspect(store, task, parameters)
        cpu = time.process_time() - began
        with store.read() as connection:
            states = store.columns(connection, "result/presence", run_id=answer.run)["state"].tolist()
    mm, degrees = np.inf, np.inf
    if answer.world_from_rig is not None:
        (mm,), (degrees,) = compute_errors(answer.world_from_rig[None], case.world_from_rig)
    undecided = sum(state in ("not_confirmed", "undecidable") for state in states)
    return {
        "verdict": answer.verdict, "mm": round(float(mm), 3), "degrees": round(float(degrees), 3),
        "decided": len(states) - undecided, "open": undecided, "cpu": round(cpu, 1),
    }  # fmt: skip


if __name__ == "__main__":
    sys.exit(main())
