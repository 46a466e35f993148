"""Pictures of strangers, parts that nothing was fitted on, with exact truth: good, changed, stretched and look-alikes.

    python -m examples.render.strangers FOLDER --seed N [--models 3] [--only FAMILY/KIND ...]

Of each model (`FAMILY_K_model.step`): three views of a good part, two of the changes that fit it, a part that is the
model stretched along an axis and another part of the same outline.  A trial whose truth lies in FOLDER is left alone.
Needs the extra `render` and DRJIT_LIBLLVM_PATH, as `examples.render.trials` does."""

from __future__ import annotations

import argparse
import time
import zlib
from collections.abc import Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from examples.render.draws import draw_finish, draw_table_view
from examples.render.families import FAMILIES, Design, can_make, changes, draw, make
from examples.render.files import STATED
from examples.render.lights import table
from examples.render.model import Component, tessellate
from examples.render.objects import write_step
from examples.render.surfaces import finished_meshes
from examples.render.trials import Trial, write_trial
from examples.render.truth import Caster, project
from examples.render.views import Shot, rigid

Array = NDArray[np.float64]
SIZE = (960, 720)
SAMPLES = 8  # rays a pixel, before the noise is taken out
VIEWS = 3  # of a good part
FILLS = (0.55, 0.85)  # of the width, by the length from corner to corner
CHANGES = ("missing", "resized", "offset")
LEAST_EDGE_PX = 40.0  # in view of what is changed
LEAST_MOVE_PX = 3.0  # of an edge of a stretched part, whatever the pose


@dataclass(frozen=True)
class Stranger:
    """A trial: the model's family and number, and what is shown of it."""

    family: str
    number: int
    kind: str
    view: int
    seed: int

    @property
    def model(self) -> str:
        return f"{self.family}_{self.number}"

    @property
    def name(self) -> str:
        return f"{self.model}_{self.kind}" + (f"_{self.view + 1}" if self.kind == "good" else "")

    def seed_of(self, name: str) -> int:
        """What the model, or else all that is the trial's own, is drawn from."""
        return self.seed * 100_000 + zlib.crc32(name.encode()) % 100_000


def strangers(seed: int, models: int, only: list[str] | None = None) -> Iterator[Stranger]:
    """All trials of a seed, those of one model after the other."""
    for number in range(models):
        for k, family in enumerate(FAMILIES):
            kinds = [("good", view) for view in range(VIEWS)]
            kinds += [(kind, 0) for i, kind in enumerate(CHANGES) if i != (number + k) % 3]
            kinds += [("stretched", 0), ("other", 0)]
            for kind, view in kinds:
                if not only or any(word in (family, kind, f"{family}/{kind}") for word in only):
                    yield Stranger(family, number, kind, view, seed)


def components_of(design: Design) -> list[Component]:
    """A design as meshes."""
    shapes, placed = make(design)
    parts = {product: tessellate(product, shape) for product, shape in shapes.items()}
    return [Component(name, parts[product], place) for name, product, place in placed]


def stretch(components: list[Component], factors: Array) -> list[Component]:
    """The object stretched along its axes (3,)."""
    out = []
    for c in components:
        turn, shift = c.object_from_part[:3, :3], c.object_from_part[:3, 3]
        normals = c.part.normals @ turn.T / factors
        normals /= np.linalg.norm(normals, axis=1, keepdims=True)
        part = replace(c.part, vertices=(c.part.vertices @ turn.T + shift) * factors, normals=normals)
        out.append(Component(c.path, part, np.eye(4)))
    return out


def sharp_edges(components: list[Component], step: float = 1.0) -> Array:
    """Ends (2, n, 3) of pieces up to `step` mm long of all edges at which two faces meet at 20 degrees and more."""
    out = []
    for c in components:
        part = c.part
        sides = np.concatenate([part.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
        _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
        rim = sides[first[count == 1]]  # the borders of faces
        _, group = np.unique(part.vertices[rim].mean(axis=1).round(3), axis=0, return_inverse=True)
        order = np.argsort(group.ravel(), kind="stable")
        pair = np.flatnonzero(np.diff(group.ravel()[order]) == 0)
        one, two = rim[order[pair]], rim[order[pair + 1]]
        cosine = np.sum(part.normals[one[:, 0]] * part.normals[two].mean(axis=1), axis=1)
        ends = part.vertices[one[cosine < np.cos(np.radians(20))]]
        for p, q in ends @ c.object_from_part[:3, :3].T + c.object_from_part[:3, 3]:
            at = np.linspace(p, q, int(np.ceil(np.linalg.norm(q - p) / step)) + 1)
            out.append([at[:-1], at[1:]])
    return np.concatenate(out, axis=1)


def seen_px(edges: Array, caster: Caster, view: Shot, side: str) -> Array:
    """Lengths in a camera's picture (n,) of pieces of edges, 0 where hidden or outside."""
    camera, pose, middle = view.cameras[side], view.poses[side], edges.mean(axis=0)
    far = np.linalg.norm(middle - pose[:3, 3], axis=1)
    hit, depth = caster.cast(pose[:3, 3], (middle - pose[:3, 3]) / far[:, None])
    start, at, end = (project(camera, pose, points) for points in (edges[0], middle, edges[1]))
    shown = ((hit < 0) | (depth > far - 0.4)) & ((at > 4) & (at < np.array(camera.size) - 5)).all(axis=1)
    return np.where(shown, np.linalg.norm(end - start, axis=1), 0.0)


def edge_px(edges: Array, box: Any, caster: Caster, view: Shot) -> dict[str, float]:
    """How long the edges in a box are in each picture."""
    middle = edges.mean(axis=0)
    own = ((middle > np.array(box[0]) - 0.2) & (middle < np.array(box[1]) + 0.2)).all(axis=1)
    return {side: round(float(seen_px(edges[:, own], caster, view, side).sum()), 1) for side in view.cameras}


def move_px(edges: Array, factors: Array, caster: Caster, view: Shot) -> float:
    """How far across itself (95th percentile, px) an edge lies from the model's when the model, not the part that is
    stretched, is laid over the pictures as well as it can be."""
    rows = []
    for side, camera in view.cameras.items():
        pose, seen = view.poses[side], edges[:, seen_px(edges, caster, view, side) > 0]
        middle = seen.mean(axis=0)
        start, at, end = (project(camera, pose, points) for points in (seen[0], middle, seen[1]))
        across = (end - start)[:, ::-1] * [-1, 1] / np.linalg.norm(end - start, axis=1)[:, None]
        ways = [*np.eye(3), *(np.cross(axis, middle) for axis in np.eye(3))]
        moves = [*(1e-3 * way for way in ways), middle * (factors - 1)]
        rows.append([np.sum((project(camera, pose, middle + move) - at) * across, axis=1) for move in moves])
    *known, shift = np.concatenate(rows, axis=1)
    basis = np.transpose(known)
    left = shift - basis @ np.linalg.lstsq(basis, shift, rcond=None)[0]
    return float(np.percentile(np.abs(left), 95))


def as_stated(view: Shot, rng: np.random.Generator) -> Shot:
    """The cameras as a calibration of the stated accuracy has them."""
    cameras, poses = {}, {}
    for side, camera in view.cameras.items():
        x, y = (v + rng.normal(0, STATED["centre_px"]) for v in camera.centre)
        radial = (camera.distortion[0] + rng.normal(0, STATED["radial"]), *camera.distortion[1:])
        focal = camera.focal + rng.normal(0, STATED["focal_px"])
        cameras[side] = replace(camera, focal=focal, centre=(x, y), distortion=radial)
        turn = Rotation.from_rotvec(np.radians(rng.normal(0, STATED["rotation_deg"], 3)))
        error = np.eye(4) if side == "left" else rigid(turn, rng.normal(0, STATED["translation_mm"], 3))
        poses[side] = view.poses[side] @ error
    return replace(view, cameras=cameras, poses=poses)


def show(stranger: Stranger, folder: Path) -> None:
    """Write the pictures and the truth of a trial, and its model if it is not there."""
    own_seed, model_seed = stranger.seed_of(stranger.name), stranger.seed_of(stranger.model)
    design = draw(stranger.family, model_seed)
    step = folder / f"{stranger.model}_model.step"
    if not step.exists():
        write_step(make(design), step)
    rng = np.random.default_rng([own_seed, 41])
    model = components_of(design)
    caster, edges = Caster(model), sharp_edges(model)
    cameras = 1 + int(rng.random() < 0.55)
    view = draw_table_view(own_seed, SIZE, np.concatenate(caster.vertices), cameras, FILLS)
    head: dict[str, Any] = {"model": step.name, "model_variant": "", "object": stranger.model}
    shown = model
    if stranger.kind in CHANGES:
        found = list(changes(design, stranger.kind, rng))
        order = [found[i] for i in rng.permutation(len(found))]
        order += [other for kind in CHANGES for other in changes(design, kind, np.random.default_rng(own_seed))]
        lengths = [edge_px(edges, change.reach, caster, view) for change, _ in order]
        rank = sorted(range(len(order)), key=lambda i: (i >= len(found), max(lengths[i].values()) < LEAST_EDGE_PX))
        number = next(i for i in rank if can_make(order[i][1]))  # of another kind where the kernel can make none
        head["change"] = asdict(order[number][0]) | {"edge_px": lengths[number]}
        shown = components_of(order[number][1])
    elif stranger.kind == "stretched":
        moved = 0.0
        while moved < LEAST_MOVE_PX:
            factors = np.ones(3)
            factors[rng.integers(3)] += rng.uniform(0.03, 0.12) * rng.choice([-1, 1])
            moved = move_px(edges, factors, caster, view)
        shown = stretch(model, factors)
        head |= {"factors": factors.round(4).tolist(), "move_px": round(moved, 2)}
    elif stranger.kind == "other":
        shown = components_of(draw(stranger.family, model_seed, 1))
    finishes = [draw_finish(rng) for _ in range(2)]
    while stranger.family == "casting" and finishes[0][0] not in ("blasted", "painted"):
        finishes[0] = draw_finish(rng)
    head["finish"] = finishes[0][0]
    each = [finishes[int(c.path.startswith("BOLT"))][1] for c in shown]

    def scene(mi: Any) -> dict[str, Any]:
        meshes = finished_meshes(mi, shown, each, np.random.default_rng([own_seed, 16]))
        return {**meshes, "table": table(mi, np.random.default_rng([own_seed, 17]))}

    trial = Trial(stranger.name, stranger.kind, stranger.family, own_seed, SIZE, len(view.cameras))
    stated = as_stated(view, np.random.default_rng([own_seed, 42]))
    write_trial(trial, folder, head, view, shown, Caster(shown), scene, True, stated, SAMPLES)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--seed", type=int, required=True)
    parser.add_argument("--models", type=int, default=3, help="of each family")
    parser.add_argument("--only", nargs="*", default=[], help="FAMILY, KIND or FAMILY/KIND")
    args = parser.parse_args()
    args.folder.mkdir(parents=True, exist_ok=True)
    for stranger in strangers(args.seed, args.models, args.only):
        if not (args.folder / f"{stranger.name}_truth.json").exists():
            began = time.monotonic()
            show(stranger, args.folder)
            print(f"{stranger.name}: {time.monotonic() - began:.0f} s", flush=True)


if __name__ == "__main__":
    main()
