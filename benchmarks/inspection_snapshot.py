"""What inspections answer, kept and compared later: whether a change moved any verdict, state or pose.

    python benchmarks/inspection_snapshot.py make FILE [--checkout DIR]     inspects right and wrong pairs by the code
                                                                            of a checkout, keeps the answers as JSON
    python benchmarks/inspection_snapshot.py compare OLD NEW [--mm MM] [--rad RAD]

Pairs are the demonstration's, each against its own variant with its prior and without, the first also swapped and
against the other variant, and of the folder that RELMODEL_TEST_DATA names all pairs of the bulkheads with their small
prior and without, and of C with their `half_pitch` prior.  Rigs are stated to be exact.  Verdicts, states and what is
told of variants must be equal, poses to 1e-9 or as given."""

from __future__ import annotations

import argparse
import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from functools import cache
from itertools import product
from pathlib import Path
from typing import Any

import numpy as np
import yaml

CHECKOUT = Path(__file__).resolve().parents[1]
DEMO = CHECKOUT / "examples/demo"
code = CHECKOUT  # whose code answers
KINDS = {"A": ("small", None), "B": ("small", None), "C": ("small", "half_pitch", None)}


def run(*words: object, status: tuple[int, ...] = (0,)) -> str:
    command = [sys.executable, "-m", "relmodel", *map(str, words)]
    done = subprocess.run(command, cwd=code, capture_output=True, text=True, check=False)
    if done.returncode not in status:
        sys.exit(f"relmodel {' '.join(map(str, words))}: {done.stderr}")
    return done.stdout


@cache
def by_option() -> bool:
    """Whether the code takes pictures by options, as it did before cameras had names."""
    return "--left" in run("inspect", "--help")


def inspect(store: Path, stem: Path, rig: Path, prior: Path | None, at: str, *, swap: bool = False) -> dict[str, Any]:
    sides = dict(zip(("left", "right"), ("right", "left") if swap else ("left", "right"), strict=True))
    given: list[object] = ["--rig", rig, "--world", at, *(("--prior", prior) if prior else ())]
    for camera, side in sides.items():
        picture = f"{stem}_{side}.png"
        given += [f"--{camera}", picture] if by_option() else [f"{camera}={picture}"]
    answer = json.loads(run("inspect", "--store", store, *given, "--format", "json", status=(0, 1)))
    keys = ("verdict", "world_from_rig", "covariance", "posterior", "parts_in_view", "presence", "variants")
    return {key: answer[key] for key in keys}


def write_rig(file: Path, cameras: dict[str, Any]) -> None:
    """A rig that is stated to be exact, in words that older code knows too."""
    file.write_text(yaml.safe_dump({"sigma": {"centre_px": 0}, "cameras": cameras}))


def demonstration(folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    store, worlds = folder / "demo.duckdb", {}
    run("init", "--store", store)
    for variant, file in (("A", "world.yaml"), ("B", "world_B.yaml")):
        run(
            "load", DEMO / f"bulkhead_{variant}.step.gz", "--object", "bulkhead", "--variant", variant, "--store", store
        )
        run("world", DEMO / file, "--store", store)
        worlds[variant] = yaml.safe_load((DEMO / file).read_text())["world"]
    for truth in sorted(DEMO.glob("pair_*_truth.json")):
        name = truth.name.removesuffix("_truth.json")
        variant = json.loads(truth.read_text())["variant"]
        rig = folder / f"{name}_rig.yaml"
        write_rig(rig, yaml.safe_load((DEMO / rig.name).read_text())["cameras"])
        files = (store, DEMO / name, rig, DEMO / f"{name}_prior.yaml")
        yield f"demo {name}", inspect(*files, worlds[variant])
        yield f"demo {name} no prior", inspect(*files[:3], None, worlds[variant])
        if name == "pair_00":
            yield f"demo {name} swapped", inspect(*files, worlds[variant], swap=True)
        if name in ("pair_00", "pair_04"):
            yield f"demo {name} other variant", inspect(*files, worlds["B" if variant == "A" else "A"])


def shared(data: Path, folder: Path) -> Iterator[tuple[str, dict[str, Any]]]:
    rig_file, prior_file, world_file = (folder / f"{name}.yaml" for name in ("rig", "prior", "world"))
    for part, kinds in KINDS.items():
        pairs, store = data / "bulkhead" / part / "pairs", folder / f"{part}.duckdb"
        truths = [json.loads(file.read_text()) for file in sorted(pairs.glob("pair_*_truth.json"))]
        run("init", "--store", store)
        run("load", pairs.parent / "bulkhead_parts.step", "--object", "bulkhead", "--store", store)
        placed = {"object": "bulkhead", "world_from_object": truths[0]["T_world_part"]}
        world_file.write_text(yaml.safe_dump({"world": "cell", "objects": [placed]}))
        run("world", world_file, "--store", store)
        for truth, kind in product(truths, kinds):
            (width, height), cameras = truth["image_size"], {}
            for side, pose in (("left", np.eye(4).tolist()), ("right", truth["T_left_right"])):
                matrix = truth["cameras"][side]["K"]
                cameras[side] = {"width": width, "height": height, "matrix": matrix, "rig_from_camera": pose}
            write_rig(rig_file, cameras)
            stem = pairs / f"pair_{truth['pair']:02d}"
            if kind is None:
                yield f"{part}{truth['pair']} no prior", inspect(store, stem, rig_file, None, "cell")
                continue
            prior = truth["priors"].get(kind)
            if prior is None:
                continue
            sigma = {"translation_mm": max(prior["mm"] / 3**0.5, 1.0), "rotation_deg": max(prior["deg"] / 3**0.5, 0.5)}
            prior_file.write_text(yaml.safe_dump({"world_from_rig": prior["T_world_cam_left"], "sigma": sigma}))
            yield f"{part}{truth['pair']} {kind}", inspect(store, stem, rig_file, prior_file, "cell")


def make(file: Path) -> None:
    answers = {}
    with tempfile.TemporaryDirectory() as folder:
        sets = [demonstration(Path(folder))]
        if data := os.environ.get("RELMODEL_TEST_DATA"):
            sets.append(shared(Path(data), Path(folder)))
        for found in sets:
            for name, answer in found:
                answers[name] = answer
                print(name, answer["verdict"], flush=True)
    file.write_text(json.dumps(answers))


def compare(old: Path, new: Path, mm: float, rad: float) -> int:
    before, after = (json.loads(file.read_text()) for file in (old, new))
    differ = [f"{name}: in one of the two only" for name in sorted(before.keys() ^ after.keys())]
    for name in sorted(before.keys() & after.keys()):
        a, b = before[name], after[name]
        if a["verdict"] != b["verdict"]:
            differ.append(f"{name}: {a['verdict']} is now {b['verdict']}")
        if (a["world_from_rig"] is None) != (b["world_from_rig"] is None):
            differ.append(f"{name}: a pose in one of the two only")
        elif a["world_from_rig"] is not None:
            off = np.abs(np.array(a["world_from_rig"]) - np.array(b["world_from_rig"]))
            if off[:3, 3].max() > mm or off[:3, :3].max() > rad:
                differ.append(f"{name}: moved by {off[:3, 3].max():.3g} mm, {off[:3, :3].max():.3g} rad")
        states = [
            {(r["level"], r["path"]): r["state"] for r in (one["presence"] or {"items": []})["items"]} for one in (a, b)
        ]
        differ += [
            f"{name}: {' '.join(item)}: {states[0].get(item)} is now {states[1].get(item)}"
            for item in sorted(states[0].keys() | states[1].keys())
            if states[0].get(item) != states[1].get(item)
        ]
        told = [[(v["object"], v["variant"]) for v in one["variants"]] for one in (a, b)]
        if told[0] != told[1]:
            differ.append(f"{name}: variants {told[0]} are now {told[1]}")
    print("\n".join(differ) or f"{len(before)} inspections equal")
    return len(differ) > 0


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    verbs = parser.add_subparsers(dest="verb", required=True)
    making = verbs.add_parser("make")
    making.add_argument("file", type=Path)
    making.add_argument("--checkout", type=Path, default=CHECKOUT, help="whose code answers (default: this one's)")
    comparing = verbs.add_parser("compare")
    comparing.add_argument("old", type=Path)
    comparing.add_argument("new", type=Path)
    comparing.add_argument("--mm", type=float, default=1e-9, help="how far poses may move (default 1e-9)")
    comparing.add_argument("--rad", type=float, default=1e-9, help="how far they may turn (default 1e-9)")
    given = parser.parse_args()
    if given.verb == "make":
        global code
        code = given.checkout.resolve()
        make(given.file)
    else:
        sys.exit(compare(given.old, given.new, given.mm, given.rad))


if __name__ == "__main__":
    main()
