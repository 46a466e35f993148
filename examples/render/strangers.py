"""Pictures of strangers, parts that nothing was fitted on, with exact truth: good, changed, stretched and look-alikes.

    python -m examples.render.strangers FOLDER --seed N [--models 3] [--only FAMILY/KIND ...]

Of each model (`FAMILY_K_model.step`): three views of a good part, two of the changes that fit it, a part that is the
model stretched along an axis and another part of the same outline.  A trial whose truth lies in FOLDER is left alone.
Needs the extra `render` and DRJIT_LIBLLVM_PATH, as `examples.render.trials` does.
"""

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
from examples.render.families import FAMILIES, Change, Design, changes, draw, make
from examples.render.files import STATED
from examples.render.lights import table
from examples.render.model import Component, tessellate
from examples.render.objects import write_step
from examples.render.surfaces import finished_meshes
from examples.render.trials import Trial, write_trial
from examples.render.truth import Caster, project
from examples.render.views import Camera, Shot, rigid

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

    @property
    def own_seed(self) -> int:
        """Of the views and all else that is the trial's own."""
        return self.seed * 100_000 + zlib.crc32(self.name.encode()) % 100_000

    @property
    def model_seed(self) -> int:
        return self.seed * 100_000 + zlib.crc32(self.model.encode()) % 100_000


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


def sharp_edges(components: list[Component], step: float = 1.0) -> tuple[Array, Array]:
    """Both ends (n, 3) of pieces up to `step` mm long of all edges at which two faces meet at 20 degrees and more."""
    starts, ends = [], []
    for c in components:
        part = c.part
        sides = np.concatenate([part.triangles[:, [i, (i + 1) % 3]] for i in range(3)])
        _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
        rim = sides[first[count == 1]]  # the border of a face
        key = np.round(part.vertices[rim].mean(axis=1), 3)
        _, group = np.unique(key, axis=0, return_inverse=True)
        order = np.argsort(group.ravel(), kind="stable")
        pair = np.flatnonzero(np.diff(group.ravel()[order]) == 0)
        one, two = rim[order[pair]], rim[order[pair + 1]]
        cosine = np.sum(part.normals[one[:, 0]] * part.normals[two].mean(axis=1), axis=1)
        for p, q in (
            part.vertices[one[cosine < np.cos(np.radians(20))]] @ c.object_from_part[:3, :3].T
            + c.object_from_part[:3, 3]
        ):
            at = np.linspace(0, 1, int(np.ceil(np.linalg.norm(q - p) / step)) + 1)[:, None]
            points = p + at * (q - p)
            starts.append(points[:-1])
            ends.append(points[1:])
    return np.concatenate(starts), np.concatenate(ends)


def seen_px(edges: tuple[Array, Array], caster: Caster, view: Shot, side: str) -> Array:
    """Lengths in a camera's picture (n,) of pieces of edges, 0 where hidden or outside."""
    camera, pose = view.cameras[side], view.poses[side]
    middle = (edges[0] + edges[1]) / 2
    ray = middle - pose[:3, 3]
    far = np.linalg.norm(ray, axis=1)
    hit, depth = caster.cast(pose[:3, 3], ray / far[:, None])
    shown = (hit < 0) | (depth > far - 0.4)
    at = project(camera, pose, middle)
    shown &= ((at > 4) & (at < np.array(camera.size) - 5)).all(axis=1)
    length = np.linalg.norm(project(camera, pose, edges[1]) - project(camera, pose, edges[0]), axis=1)
    return np.where(shown, length, 0.0)


def edge_px(edges: tuple[Array, Array], box: Any, caster: Caster, view: Shot) -> dict[str, float]:
    """How long the edges in a box are in each picture."""
    middle = (edges[0] + edges[1]) / 2
    own = ((middle > np.array(box[0]) - 0.2) & (middle < np.array(box[1]) + 0.2)).all(axis=1)
    inside = edges[0][own], edges[1][own]
    return {side: round(float(seen_px(inside, caster, view, side).sum()), 1) for side in view.cameras}


def move_px(edges: tuple[Array, Array], factors: Array, caster: Caster, view: Shot) -> float:
    """How far across itself (95th percentile, px) an edge lies from the model's when the model, not the part that is
    stretched, is laid over the pictures as well as it can be."""
    rows, shifts = [], []
    for side, camera in view.cameras.items():
        pose, seen = view.poses[side], seen_px(edges, caster, view, side) > 0
        start, end = edges[0][seen], edges[1][seen]
        middle = (start + end) / 2
        along = project(camera, pose, end) - project(camera, pose, start)
        across = np.stack([-along[:, 1], along[:, 0]], axis=1) / np.linalg.norm(along, axis=1)[:, None]
        at = project(camera, pose, middle)

        def off(
            moved: Array, camera: Camera = camera, pose: Array = pose, at: Array = at, across: Array = across
        ) -> Array:
            return np.asarray(np.sum((project(camera, pose, moved) - at) * across, axis=1))

        turns = [off(middle + 1e-3 * np.cross(axis, middle)) / 1e-3 for axis in np.eye(3)]
        rows.append(np.stack([*turns, *(off(middle + axis) for axis in np.eye(3))], axis=1))
        shifts.append(off(middle * factors))
    shift, jacobian = np.concatenate(shifts), np.concatenate(rows)
    left = shift - jacobian @ np.linalg.lstsq(jacobian, shift, rcond=None)[0]
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
    design = draw(stranger.family, stranger.model_seed)
    step = folder / f"{stranger.model}_model.step"
    if not step.exists():
        write_step(make(design), step)
    rng = np.random.default_rng([stranger.own_seed, 41])
    model = components_of(design)
    caster, edges = Caster(model), sharp_edges(model)
    points = np.concatenate(caster.vertices)
    view = draw_table_view(stranger.own_seed, SIZE, points, 1 + int(rng.random() < 0.55), FILLS)
    head: dict[str, Any] = {"model": step.name, "model_variant": "", "object": stranger.model}
    shown = model
    if stranger.kind in CHANGES:
        change, changed = draw_change(design, stranger.kind, rng, lambda box: edge_px(edges, box, caster, view))
        shown = components_of(changed)
        head["change"] = asdict(change) | {"edge_px": edge_px(edges, change.reach, caster, view)}
    elif stranger.kind == "stretched":
        for _ in range(40):
            factors = np.ones(3)
            factors[rng.integers(3)] += rng.uniform(0.03, 0.12) * rng.choice([-1, 1])
            if (moved := move_px(edges, factors, caster, view)) >= LEAST_MOVE_PX:
                break
        else:
            raise RuntimeError(f"no stretch of {stranger.name} shows")
        shown = stretch(model, factors)
        head |= {"factors": factors.round(4).tolist(), "move_px": round(moved, 2)}
    elif stranger.kind == "other":
        shown = components_of(draw(stranger.family, stranger.model_seed, 1))
    finishes = [draw_finish(rng) for _ in range(2)]
    if stranger.family == "casting":  # as cast and painted, or blasted
        while finishes[0][0] not in ("blasted", "painted"):
            finishes[0] = draw_finish(rng)
    head["finish"] = finishes[0][0]
    each = [finishes[int(c.path.startswith("BOLT"))][1] for c in shown]

    def scene(mi: Any) -> dict[str, Any]:
        meshes = finished_meshes(mi, shown, each, np.random.default_rng([stranger.own_seed, 16]))
        return {**meshes, "table": table(mi, np.random.default_rng([stranger.own_seed, 17]))}

    trial = Trial(stranger.name, stranger.kind, stranger.family, stranger.own_seed, SIZE, len(view.cameras))
    stated = as_stated(view, np.random.default_rng([stranger.own_seed, 42]))
    write_trial(trial, folder, head, view, shown, Caster(shown), scene, True, stated, SAMPLES)


def draw_change(design: Design, kind: str, rng: np.random.Generator, seen: Any) -> tuple[Change, Design]:
    """One of the changes of a kind whose edges are in view, that the kernel can make."""
    found = list(changes(design, kind, rng))
    order = [found[i] for i in rng.permutation(len(found))]
    wanted = [f for f in order if max(seen(f[0].reach).values()) >= LEAST_EDGE_PX]
    for change, changed in wanted or order:
        try:
            components_of(changed)
        except RuntimeError:
            continue
        return change, changed
    raise RuntimeError(f"the kernel makes no {kind} change of {design.name}")


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
