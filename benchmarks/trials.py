"""Trials of localisation with known truth: right ones and wrong ones, from every set of pictures at hand.

A trial is a world, a rig, one or two pictures and a prior; its truth is the rig's pose, or none where the pictures do
not show what the model says.  The sets are the demonstration's pairs, the test data (RELMODEL_TEST_DATA) and what
`python -m examples.render.trials` wrote.  Wrong trials are made from right ones: pictures of something else, mirrored,
blank, blurred, swapped, of another part, a prior elsewhere.  Each gives a line of JSON: a run broken off goes on."""

from __future__ import annotations

import hashlib
import json
import os
import sys
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import cv2
import numpy as np
import sqlalchemy as sa
import yaml
from numpy.typing import NDArray

from relmodel.arrays import Floats
from relmodel.geometry.transforms import apply, inverse
from relmodel.loading.load import load
from relmodel.resources import resource_dir
from relmodel.store import Store
from relmodel.world.placement import place_world
from vision.cameras.cameras import CalibrationSigma, Camera, Prior, Rig, perturb
from vision.cameras.files import read_prior, read_rig, write_rig
from vision.cameras.images import read_picture
from vision.inspection import Inspection, Task, inspect
from vision.inspection.demonstration import read_truth
from vision.inspection.inspection_parameters import DEFAULTS, InspectionParameters
from vision.scene import Scene, StoredScene, read_scene

CALIBRATED = CalibrationSigma(0.0002, 0.2, 0.02, 5e-5)  # as a good file says: .3 px of 1,500, .2 px, .02 mm, .003 deg
Pictures = dict[str, NDArray[Any]]  # grey, by camera
# The poses that the join gave an inspection, the best first.
JOINED_POSES = sa.text("SELECT * FROM search_pose WHERE run_id = :run AND stage IN ('join', 'lines') ORDER BY pose_no")


@dataclass(frozen=True)
class Trial:
    """What localisation is given, and the truth.

    group: the set that the pictures are from; kind: 'as_is', or how it was made wrong or drawn; model: name of the
    scene; world_from_rig: the truth, None where no pose is right; target (3,): in the world, where errors are measured;
    files: of the pictures as they are."""

    name: str
    group: str
    kind: str
    model: str
    rig: Rig
    pictures: Pictures
    prior: Prior | None
    world_from_rig: Floats | None
    target: Floats
    files: dict[str, Path]


def find_data() -> Path:
    """The folder of the test data."""
    data = os.environ.get("RELMODEL_TEST_DATA")
    if not data:
        sys.exit("set RELMODEL_TEST_DATA to the folder of the test data")
    return Path(data)


def read_lines(*files: Path) -> list[dict[str, Any]]:
    """What was measured; of a file that is not there nothing."""
    return [json.loads(line) for file in files if file.exists() for line in file.open()]


def add_line(file: Path, line: dict[str, Any]) -> None:
    with file.open("a") as out:
        out.write(json.dumps(line) + "\n")


def inspect_trial(
    store: Store, trial: Trial, folder: Path, parameters: InspectionParameters = DEFAULTS, **more: Any
) -> Inspection:
    """An inspection of what a trial gives; its rig and prior are written into the folder; more: of `Task`."""
    write_rig(trial.rig, folder / "rig.yaml")
    if trial.prior is not None:
        stated = {"world_from_rig": trial.prior.world_from_rig.tolist(), "covariance": trial.prior.covariance.tolist()}
        (folder / "prior.yaml").write_text(yaml.safe_dump(stated))
    prior = None if trial.prior is None else folder / "prior.yaml"
    return inspect(store, Task(rig=folder / "rig.yaml", pictures=trial.files, prior=prior, **more), parameters)


def compute_errors(poses: Floats, true: Floats) -> tuple[Floats, Floats]:
    """How far (mm) poses (k, 4, 4) put a point 700 mm before the rig from the true place, and turn it (degrees)."""
    ahead = np.array([0.0, 0.0, 700.0, 1.0])
    cosine = (np.einsum("kij,ij->k", poses[:, :3, :3], true[:3, :3]) - 1) / 2
    off = np.linalg.norm((poses - true) @ ahead, axis=1)
    return np.asarray(off), np.asarray(np.degrees(np.arccos(np.clip(cosine, -1, 1))))


def compute_error(answer: Inspection, true: Floats | None) -> tuple[float, float]:
    """The same of the pose that an inspection found, infinite where it found none."""
    if answer.world_from_rig is None or true is None:
        return np.inf, np.inf
    (mm,), (degrees,) = compute_errors(answer.world_from_rig[None], true)
    return float(mm), float(degrees)


def find_rank(poses: Floats, true: Floats) -> int | None:
    """Place among poses (k, 4, 4) of the first that lies within 10 mm and 2 degrees of the true one."""
    if not len(poses):
        return None
    mm, degrees = compute_errors(poses, true)
    near = np.flatnonzero((mm <= 10.0) & (degrees <= 2.0))
    return int(near[0]) + 1 if len(near) else None


def draw_prior(truth: Floats, mm: float, degrees: float, seed: tuple[int, ...]) -> Prior:
    """A prior of that sigma per axis whose error is a draw from it."""
    turn = np.radians(degrees)
    error = np.random.default_rng(seed).normal(size=6) * np.repeat([mm, turn], 3)
    return Prior.isotropic(perturb(truth, error), mm, float(turn))


class Models:
    """Scenes by name, each loaded once into a store of the folder."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.sources: dict[str, tuple[Path, Floats, str | None]] = {}
        self._stored: dict[str, StoredScene] = {}

    def add(self, name: str, file: Path, world_from_object: Floats, unit: str | None = None) -> str:
        self.sources[name] = (file, world_from_object, unit)
        return name

    def scene(self, name: str) -> Scene:
        return self.stored(name).scene

    def stored(self, name: str) -> StoredScene:
        if name not in self._stored:
            with self.open(name) as store, store.read() as connection:
                self._stored[name] = read_scene(store, connection, 1)
        return self._stored[name]

    def open(self, name: str) -> Store:
        """The store of a model, which stands alone in its world 1, `cell`."""
        file, placed, unit = self.sources[name]
        path = self.folder / f"{name}.duckdb"
        if path.exists():
            return Store.open(path)
        world = {"world": "cell", "objects": [{"object": "object", "world_from_object": placed.tolist()}]}
        (self.folder / f"{name}.yaml").write_text(yaml.safe_dump(world))
        with Store.create(self.folder / f"{name}.part.duckdb") as store:
            load(store, file, name="object", unit=unit)
            place_world(store, self.folder / f"{name}.yaml")
        (self.folder / f"{name}.part.duckdb").rename(path)
        return Store.open(path)


def read_greys(files: dict[str, Path]) -> Pictures:
    return {name: read_picture(file).grey for name, file in files.items()}


def demonstration(models: Models) -> Iterator[Trial]:
    """The demonstration's pairs with the priors beside them, and with drawn ones."""
    demo = resource_dir("demo")
    for file in sorted(demo.glob("pair_*_truth.json")):
        stem, truth = file.name.removesuffix("_truth.json"), read_truth(file)
        placed = np.array(json.loads(file.read_text())["world_from_object"], float)
        model = models.add(f"demo_{truth.variant}", demo / f"bulkhead_{truth.variant}.step.gz", placed)
        files = {side: demo / f"{stem}_{side}.png" for side in ("left", "right")}
        rig = read_rig(demo / f"{stem}_rig.yaml").only("left", "right")
        prior = read_prior(demo / f"{stem}_prior.yaml")
        yield Trial(
            f"demo {stem}", "demo", "as_is", model, rig, read_greys(files), prior, truth.world_from_rig, truth.target,
            files,
        )  # fmt: skip


def shared_bulkheads(data: Path, models: Models, priors: tuple[str, ...], parts: str = "ABC") -> Iterator[Trial]:
    """The rendered pairs of the test data with their stored priors (small, large, half_pitch, one_pitch)."""
    for part in parts:
        folder = data / "bulkhead" / part
        for file in sorted((folder / "pairs").glob("pair_*_truth.json")):
            t = json.loads(file.read_text())
            placed = np.array(t["T_world_part"], float)
            model = models.add(f"shared_{part}", folder / "bulkhead_parts.step", placed)
            cameras, poses, files = {}, {}, {}
            for side in ("left", "right"):
                camera = t["cameras"][side]
                cameras[side] = Camera(t["image_size"][0], t["image_size"][1], np.array(camera["K"], float))
                poses[side] = np.eye(4) if side == "left" else np.array(t["T_left_right"], float)
                files[side] = folder / "pairs" / camera["image"]
            pictures = read_greys(files)
            truth = np.array(t["cameras"]["left"]["T_world_cam"], float)
            target = apply(placed, np.array([[t["view"]["target_x"], t["view"]["target_y"], 0.0]]))[0]
            for name in priors:
                if (p := t["priors"].get(name)) is None:
                    continue
                mm, degrees = max(p["mm"] / np.sqrt(3), 1.0), max(p["deg"] / np.sqrt(3), 0.5)
                prior = Prior.isotropic(np.array(p["T_world_cam_left"], float), mm, float(np.radians(degrees)))
                yield Trial(
                    f"{part}{t['pair']} {name}", f"shared_{part}", "as_is", model,
                    Rig(cameras, poses, dict.fromkeys(cameras, CALIBRATED)), pictures, prior, truth, target, files,
                )  # fmt: skip


def single_pictures(data: Path, name: str, models: Models) -> Iterator[Trial]:
    """The frames of photo_cube and render_box from drawn priors of 10 mm and 3 degrees."""
    described = json.loads((data / name / "frames.json").read_text())
    model = models.add(name, data / name / "model.obj", np.eye(4), described.get("unit", "mm"))
    for number, frame in enumerate(described["frames"]):
        picture = read_picture(data / name / frame["image"])
        truth = inverse(np.array(frame["camera_from_object"], float))
        matrix = np.array(frame["K"], float)
        matrix[:2, 2] -= 0.5 * (name == "render_box")  # rendered about the middle of 640 px, which is 319.5 here
        camera = Camera(picture.width, picture.height, matrix)
        prior = draw_prior(truth, 10 / np.sqrt(3), 3 / np.sqrt(3), (1, number))
        target = apply(truth, np.array([[0.0, 0.0, float(np.linalg.norm(truth[:3, 3]))]]))[0]
        yield Trial(
            f"{name} {frame['image']}", name, "as_is", model, Rig({"left": camera}, {"left": np.eye(4)}),
            {"left": picture.grey}, prior, truth, target, {"left": data / name / frame["image"]},
        )  # fmt: skip


def alone(trial: Trial, side: str = "left") -> Trial:
    """The same with one camera."""
    own = trial.rig
    rig = Rig({"left": own.cameras[side]}, {"left": own.rig_from_camera[side]}, {"left": own.sigma_of(side)})
    return replace(trial, name=f"{trial.name} alone", kind="alone", rig=rig, pictures={"left": trial.pictures[side]})


def _mirrored(pictures: Pictures) -> Pictures:
    return {n: np.ascontiguousarray(p[:, ::-1]) for n, p in pictures.items()}


def _turned(pictures: Pictures) -> Pictures:
    return {n: np.ascontiguousarray(p[::-1, ::-1]) for n, p in pictures.items()}


def _blurred(pictures: Pictures) -> Pictures:
    return {n: np.asarray(cv2.GaussianBlur(p, (0, 0), 12.0)) for n, p in pictures.items()}


def _blank(pictures: Pictures) -> Pictures:
    rng = np.random.default_rng(7)
    return {n: np.clip(rng.normal(110, 6, p.shape), 0, 255).astype(np.uint8) for n, p in pictures.items()}


def _swapped(pictures: Pictures) -> Pictures:
    left, right = pictures
    return {left: pictures[right], right: pictures[left]}


ALTERATIONS: dict[str, Callable[[Pictures], Pictures]] = {
    "mirrored": _mirrored,
    "turned": _turned,
    "blurred": _blurred,
    "blank": _blank,
    "swapped": _swapped,
}


def _with_right(pictures: Pictures, right: NDArray[Any]) -> Pictures:
    """A pair with another picture of its second camera."""
    left, other = pictures
    return {left: pictures[left], other: np.ascontiguousarray(right)}


def _blurred_slightly(pictures: Pictures, _: Pictures) -> Pictures:
    return {n: np.asarray(cv2.GaussianBlur(p, (0, 0), 6.0)) for n, p in pictures.items()}


# Pairs of which one camera or both say nothing: from a pair and another one of the same size.
BLIND: dict[str, Callable[[Pictures, Pictures], Pictures]] = {
    "twice": lambda own, _: _with_right(own, next(iter(own.values()))),
    "right of another": lambda own, other: _with_right(own, list(other.values())[1]),
    "right black": lambda own, _: _with_right(own, np.full_like(list(own.values())[1], 8)),
    "right mirrored": lambda own, _: _with_right(own, list(own.values())[1][:, ::-1]),
    "right overexposed": lambda own, _: _with_right(own, np.clip(6.0 * list(own.values())[1], 0, 255).astype(np.uint8)),
    "blurred by 6 px": _blurred_slightly,
}


def blind(trial: Trial, kind: str, other: Trial) -> Trial:
    """The pair with pictures that say nothing, made as BLIND says: it is to be refused."""
    pictures = BLIND[kind](trial.pictures, other.pictures)
    return replace(trial, name=f"{trial.name} {kind}", kind=kind, pictures=pictures, world_from_rig=None)


def alter(trial: Trial, kind: str) -> Trial:
    """The trial with its pictures made wrong."""
    pictures = ALTERATIONS[kind](trial.pictures)
    return replace(trial, name=f"{trial.name} {kind}", kind=kind, pictures=pictures, world_from_rig=None)


def show(trial: Trial, other: Trial) -> Trial:
    """The trial with the pictures of another, cut or padded to size: foreign pictures, or another place of the part."""
    pictures = {}
    for (name, mine), theirs in zip(trial.pictures.items(), other.pictures.values(), strict=False):
        rows, columns = mine.shape
        pictures[name] = np.asarray(cv2.resize(theirs, (columns, rows), interpolation=cv2.INTER_AREA))
    if len(pictures) < len(trial.pictures):
        pictures = {name: next(iter(pictures.values())) for name in trial.pictures}
    return replace(trial, name=f"{trial.name} <- {other.name}", kind="foreign", pictures=pictures, world_from_rig=None)


def rendered(folder: Path, models: Models) -> Iterator[Trial]:
    """What `python -m examples.render.trials FOLDER` wrote, kind by kind."""
    for file in sorted(folder.glob("*/*_truth.json")):
        t = json.loads(file.read_text())
        stem = file.name.removesuffix("_truth.json")
        placed = np.array(t["world_from_object"], float)
        source = file.parent / t["model"]
        source = source if source.exists() else Path(t["model"])
        # A model is loaded once for each place that it stands at.
        key = f"{source.name.split('.')[0]}_{hash_of(placed)}"
        model = models.add(key, source, placed)
        rig = read_rig(file.with_name(f"{stem}_rig.yaml")).only(*t["cameras"])
        files = {side: file.with_name(c["image"]) for side, c in t["cameras"].items()}
        target = apply(placed, np.array([t["target_in_object"]], float))[0]
        yield Trial(
            stem, t["kind"], "as_is", model, rig, read_greys(files), read_prior(file.with_name(f"{stem}_prior.yaml")),
            np.array(t["world_from_rig"], float), target, files,
        )  # fmt: skip


def hash_of(values: Floats) -> str:
    """Eight digits that name an array's content."""
    return hashlib.sha256(np.ascontiguousarray(values).tobytes()).hexdigest()[:8]


def miscalibrate(trial: Trial, kind: str) -> Trial:
    """The trial with one camera's calibration off: its focal length by half a percent, or the baseline by 1 mm."""
    side = list(trial.rig.cameras)[-1]
    cameras, poses = dict(trial.rig.cameras), dict(trial.rig.rig_from_camera)
    if kind == "focal":
        matrix = cameras[side].matrix.copy()
        matrix[[0, 1], [0, 1]] *= 1.005
        cameras[side] = replace(cameras[side], matrix=matrix)
    else:
        poses[side] = poses[side].copy()
        poses[side][:3, 3] *= 1 + 1.0 / np.linalg.norm(poses[side][:3, 3])
    return replace(trial, name=f"{trial.name} {kind}", kind=kind, rig=Rig(cameras, poses))
