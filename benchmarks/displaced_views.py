"""Pictures assigned to views of poses that are off: precision and recall with relations and without.

`python -m benchmarks.relational_matching --displaced`, RELMODEL_TEST_DATA set.  For each picture of the rendered pairs
(folder bulkhead) the rig is moved from the truth by draws of an isotropic pose error (10 mm to a degree), scaled so
that what the view shows moves by so many px in the mean; the pose's covariance is that of the draws, scaled alike, and
arcs are compared within three of its standard deviations in the picture.

Truth: a point of an image arc shows a model arc where a visible edge sample of the rendering lies within 1.5 px of it,
along it, and that sample within 1.5 mm of the model arc's samples in space; an arc shows a model arc that half of its
points show.  Precision: of the arcs that were given a model arc, how many show it; recall: of those that show one of
the view's, how many were given one that they show.
"""

from __future__ import annotations

import json
import tempfile
from collections import defaultdict
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from scipy.spatial import cKDTree
from tabulate import tabulate

from benchmarks.trials import Models, shared_bulkheads
from relmodel.arrays import Bools, Floats
from relmodel.geometry.transforms import apply, inverse
from vision.cameras.cameras import Camera, perturb
from vision.extraction.extract import extract
from vision.extraction.rows import Primitives, make_primitives
from vision.localisation.views import ViewArcs, find_view_arcs
from vision.localisation.visibility import SurfaceMap, map_surfaces
from vision.matching import MatchingParameters, PoseMatch, describe_view, match_view
from vision.relations.relations import open_workspace
from vision.scene import Scene
from vision.stereo.epipolar import pack_arcs

STEPS = (0.0, 3.0, 10.0, 25.0)  # px
PAIRS = ("A0", "A1", "A2", "A4", "A5", "A7", "B0", "B1", "C0", "C3")
MM_A_DEGREE = 10.0
ON_EDGE, SAME_PLACE = 1.5, 1.5  # px, mm
LEAST_SIGMA = 0.05  # px that the pose makes, as after a refinement
REACH = 3.0  # standard deviations


@dataclass(frozen=True)
class Picture:
    """One picture of a rendered pair: its camera and pose, its primitives, and the visible edges of the rendering:
    places (n, 2) px, normals (n, 2), points (n, 3) mm in the world."""

    name: str
    scene: Scene
    camera: Camera
    world_from_camera: Floats
    primitives: Primitives
    place: Floats
    normal: Floats
    point: Floats


def read_pictures(data: Path, folder: Path, pairs: tuple[str, ...]) -> list[Picture]:
    """Both pictures of the pairs, extracted."""
    models = Models(folder)
    out = []
    for trial in shared_bulkheads(data, models, ("small",)):
        name = trial.name.split()[0]
        if name not in pairs:
            continue
        stem = data / "bulkhead" / name[0] / "pairs" / f"pair_{int(name[1:]):02d}"
        placed = np.array(json.loads(Path(f"{stem}_truth.json").read_text())["T_world_part"], float)
        assert trial.world_from_rig is not None
        for side, camera in trial.rig.cameras.items():
            with np.load(f"{stem}_{side}_edges.npz") as e:
                place, normal, point = (e[key].astype(float) for key in ("uv", "normal2d", "xyz_part"))
            out.append(
                Picture(
                    f"{name} {side}", models.scene(trial.model), camera,
                    trial.world_from_rig @ trial.rig.rig_from_camera[side],
                    make_primitives(extract(trial.pictures[side])), place, normal, apply(placed, point),
                )
            )  # fmt: skip
    return out


def find_shown(picture: Picture, view: ViewArcs) -> Bools:
    """Which arcs of the picture show which arcs of the view (image arcs, view arcs)."""
    arcs = pack_arcs(picture.primitives)
    owner = np.repeat(np.arange(len(arcs)), np.diff(arcs.offsets))
    at = np.arange(len(owner))
    before, after = np.maximum(at - 3, arcs.offsets[owner]), np.minimum(at + 3, arcs.offsets[owner + 1] - 1)
    along = arcs.points[after] - arcs.points[before]
    along /= np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    distance, sample = cKDTree(picture.place).query(arcs.points, k=8, distance_upper_bound=ON_EDGE)
    sample = np.minimum(sample, len(picture.place) - 1)
    good = np.isfinite(distance) & (np.abs(np.einsum("ij,ikj->ik", along, picture.normal[sample])) < 0.4)
    here, rank = np.nonzero(good)
    edge = sample[here, rank]
    near = cKDTree(picture.point[edge]).query_ball_tree(cKDTree(view.samples.point), SAME_PLACE)
    hits = [(int(point), int(run)) for point, rows in zip(here, near, strict=True) for run in set(view.run[rows])]
    shown = np.zeros((len(arcs), len(view.kind)))
    if hits:
        point, run = np.unique(np.array(hits), axis=0).T
        np.add.at(shown, (owner[point], run), 1.0)
    return np.asarray(shown >= 0.5 * np.diff(arcs.offsets)[:, None])


@dataclass(frozen=True)
class Look:
    """A picture and a view of it from a pose that is off: what is needed to match them, and the truth."""

    picture: Picture
    view: ViewArcs
    seen: SurfaceMap
    modes: Floats
    reach: float
    shown: Bools


def displace(picture: Picture, px: float, rng: np.random.Generator) -> Look:
    """The view from a pose off by a draw that moves it by `px` in the mean."""
    unit = np.repeat([1.0, np.radians(1.0) / MM_A_DEGREE], 3)
    true = find_view_arcs(picture.scene, picture.camera, picture.world_from_camera)
    jacobian = derive_places(picture.camera, picture.world_from_camera, true.samples.point) * unit
    error = rng.normal(size=6)
    moved = float(np.linalg.norm(jacobian @ error, axis=1).mean())
    pose = perturb(picture.world_from_camera, error * unit * px / moved)
    # of the draws before they were scaled: the mean of the norm of what a normal draw moves
    typical = float(np.sqrt(np.mean(np.sum(jacobian**2, axis=(1, 2)))))
    sigma = max(px, LEAST_SIGMA) / typical
    view = find_view_arcs(picture.scene, picture.camera, pose) if px else true
    modes = derive_places(picture.camera, pose, view.samples.point) * unit * sigma
    seen = map_surfaces(picture.scene, picture.camera, pose)
    return Look(picture, view, seen, modes, REACH * float(np.sqrt(np.mean(np.sum(modes**2, axis=(1, 2))) / 2)),
                find_shown(picture, view))  # fmt: skip


def derive_places(camera: Camera, world_from_camera: Floats, point: Floats, step: float = 1e-4) -> Floats:
    """(n, 2, 6): derivatives of where a camera shows world points by a right perturbation of its pose."""
    columns = []
    for axis in np.eye(6):
        ends = [
            camera.project(apply(inverse(perturb(world_from_camera, way * step * axis)), point))[0] for way in (1, -1)
        ]
        columns.append((ends[0] - ends[1]) / (2 * step))
    return np.stack(columns, axis=2)


def match(look: Look, p: MatchingParameters) -> PoseMatch:
    """The assignment of the picture to the view."""
    normal = np.stack([-look.view.samples.direction[:, 1], look.view.samples.direction[:, 0]], axis=1)
    shift = np.einsum("ni,nij->nj", normal, look.modes)
    units = describe_view(look.view, shift, look.picture.camera, look.seen)
    pose = replace(p.pose, reach_px=max(p.pose.reach_px, look.reach))
    with open_workspace() as workspace:
        return match_view(workspace, 0, look.picture.primitives, units, look.seen, pose)


def displaced(data: Path, pairs: tuple[str, ...] = PAIRS) -> str:
    """The table: one row a step."""
    counts: dict[tuple[float, str], Any] = defaultdict(lambda: np.zeros(3))
    kinds = {"with": MatchingParameters(), "without": bare(MatchingParameters())}
    with tempfile.TemporaryDirectory() as folder:
        pictures = read_pictures(data, Path(folder), pairs)
    for number, picture in enumerate(pictures):
        for step in STEPS:
            look = displace(picture, step, np.random.default_rng((number, int(step))))
            for name, p in kinds.items():
                counts[step, name] += count(look, match(look, p))
    rows = []
    for step in STEPS:
        row: list[float] = [step]
        for name in kinds:
            given, right, possible = counts[step, name]
            precision, recall = right / max(given, 1), right / max(possible, 1)
            row += [precision, recall, 2 * precision * recall / max(precision + recall, 1e-9)]
        rows.append(row)
    header = ["px", *(f"{what} {name}" for name in kinds for what in ("precision", "recall", "F1"))]
    return tabulate(rows, header, floatfmt=(".0f", *[".3f"] * 6))


def count(look: Look, found: PoseMatch) -> Floats:
    """How many arcs were given a model arc, how many rightly, how many show one."""
    taken = found.arcs.accepted
    right = look.shown[found.arcs.image_arc[taken], found.arcs.view_arc[taken]]
    return np.array([taken.sum(), right.sum(), look.shown.any(axis=1).sum()], float)


def bare(p: MatchingParameters) -> MatchingParameters:
    """The same without relations."""
    return replace(p, pose=replace(p.pose, relation_price=0.0))
