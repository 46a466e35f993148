"""How one pair is located without a prior, as a picture: relations in space, joined pairs, votes, the pose.

    python -m benchmarks.constellation [--pair NN] [--part A|B] PICTURE.png

Loads a bulkhead of the demonstration, inspects one of its pairs without a prior, and draws what the run's rows say: the
circles that stereo puts in space and their rarest relations over the left picture; where the poses of all joined pairs
put the rig, with the true place; how much of the scene the distinct poses explain; the sharp edges of the model over
the picture at the pose found.
"""

from __future__ import annotations

import argparse
import tempfile
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import sqlalchemy as sa

from relmodel.arrays import Floats, Ints
from relmodel.geometry.transforms import apply, inverse
from relmodel.loading.load import load
from relmodel.store import Store
from relmodel.store.bulk import fetch_columns
from relmodel.world.placement import place_world
from vision.cameras.cameras import Camera
from vision.cameras.files import read_rig
from vision.cameras.images import read_picture
from vision.constellations.constellation_parameters import DEFAULTS
from vision.constellations.elements import JoinedPairs, find_scene_circles, read_circles
from vision.constellations.find_poses import join_pairs, read_inspected, solve_poses
from vision.extraction.rows import read_primitives
from vision.inspection import Task, inspect
from vision.inspection.demonstration import read_truth
from vision.localisation.localise import SHARP_RAD
from vision.scene import Scene, read_scene
from vision.stereo.match import match_stereo
from vision.stereo.triangulate import SpaceArcs

# The poses that the join gave an inspection, the best first.
JOINED_POSES = sa.text(
    "SELECT p.* FROM search_pose AS p JOIN search_stage AS s ON s.run_id = p.run_id AND s.stage_no = p.stage_no"
    " WHERE p.run_id = :run AND s.name IN ('join', 'lines') ORDER BY p.pose_no"
)

DEMO = Path(__file__).parents[1] / "examples" / "demo"
RAREST = 40  # relations that are drawn


def main(arguments: Sequence[str] | None = None) -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--pair", default="00", metavar="NN")
    parser.add_argument("--part", default="A", choices=("A", "B"))
    parser.add_argument("picture", type=Path)
    args = parser.parse_args(arguments)
    pair = DEMO / f"pair_{args.pair}"
    with tempfile.TemporaryDirectory() as folder, Store.create(Path(folder) / "cell.duckdb") as store:
        load(store, DEMO / f"bulkhead_{args.part}.step.gz", name="bulkhead", variant=args.part)
        place_world(store, DEMO / ("world.yaml" if args.part == "A" else "world_B.yaml"))
        rig, left = Path(f"{pair}_rig.yaml"), Path(f"{pair}_left.png")
        answer = inspect(store, Task(rig=rig, pictures={"left": left, "right": f"{pair}_right.png"}))
        with store.read() as connection:
            seen = store.rows(connection, "audit/pictures", run=answer.run)
            one, other = (read_primitives(store, connection, it.extraction_id) for it in seen)
            space = match_stereo(read_rig(rig), one, other).triangulated
            arcs, circles = find_scene_circles(space)
            (object_id, world_from_object), *_ = read_inspected(store, connection, 1)
            joined = join_pairs(store, connection, object_id, circles.relations(DEFAULTS.join), DEFAULTS.join)
            solved = solve_poses(circles, read_circles(store, connection, object_id), joined)
            explained = fetch_columns(connection, JOINED_POSES, {"run": answer.run})["score"]
            scene = read_scene(store, connection, 1).scene
        draw(
            args.picture,
            read_picture(left).grey,
            read_rig(rig).cameras["left"],
            space,
            np.asarray(arcs),
            joined,
            world_from_object @ solved.reshape(-1, 4, 4),
            explained,
            scene,
            answer.world_from_rig,
            read_truth(Path(f"{pair}_truth.json")).world_from_rig,
        )
    print(f"wrote {args.picture}: {answer.verdict}, {answer.reason}")
    return 0


def draw(
    path: Path,
    grey: Any,
    camera: Camera,
    space: SpaceArcs,
    arcs: Ints,
    joined: JoinedPairs,
    poses: Floats,
    explained: Floats,
    scene: Scene,
    found: Floats | None,
    true: Floats,
) -> None:
    """arcs (n,): rows of the scene's circles; poses (k, 4, 4) of joined pairs, two a pair, rare ones first."""
    import matplotlib

    matplotlib.use("agg")
    from matplotlib import pyplot

    figure, ((relations, edges), (places, shares)) = pyplot.subplots(
        2, 2, figsize=(13, 8), gridspec_kw={"height_ratios": [2.1, 1]}
    )
    for axes in (relations, edges):
        axes.imshow(grey, cmap="gray", vmin=0, vmax=255)
        axes.set(xticks=[], yticks=[], xlim=(0, grey.shape[1]), ylim=(grey.shape[0], 0))
    turn = np.linspace(0, 2 * np.pi, 60)[:, None]
    for row in arcs:
        centre, major, minor = (getattr(space.conics, name)[row] for name in ("centre", "major", "minor"))
        rim, _ = camera.project(centre + np.cos(turn) * major + np.sin(turn) * minor)
        relations.plot(*rim.T, color="tab:cyan", linewidth=1.2)
    middle, _ = camera.project(space.conics.centre[arcs])
    pairs, first = np.unique(np.sort(joined.scene, axis=1), axis=0, return_index=True)
    for a, b in pairs[np.argsort(joined.alike[first], kind="stable")[:RAREST]]:
        relations.plot(*middle[[a, b]].T, color="orange", linewidth=0.8)
    relations.set_title(
        f"{len(arcs)} circles in space, {min(RAREST, len(pairs))} rarest of {len(pairs)} relations joined"
    )
    if found is not None:
        sharp = scene.reference_samples[scene.sample_cosine[scene.reference_samples] < np.cos(SHARP_RAD)]
        seen, inside = camera.project(apply(inverse(found), scene.sample_point[sharp]))
        edges.scatter(*seen[inside].T, s=0.3, color="lime")
    edges.set_title("sharp edges of the model, hidden ones too, at the pose found")
    weight = np.repeat(1.0 / joined.alike, 2)
    drawn = places.scatter(poses[:, 0, 3], poses[:, 2, 3], s=4, c=np.log10(weight), cmap="viridis")
    figure.colorbar(drawn, ax=places, label="log10 of rarity")
    places.plot(true[0, 3], true[2, 3], "r+", markersize=16, markeredgewidth=2, label="true place")
    places.set(xlabel="x of the rig, mm", ylabel="z, mm", title=f"poses of {len(joined.alike)} joined pairs")
    places.legend()
    shares.bar(np.arange(len(explained)), 100 * explained, color=["tab:green"] + ["tab:grey"] * (len(explained) - 1))
    shares.set(xlabel="distinct poses", ylabel="%", title="of the scene's edges on edges of the model")
    figure.tight_layout()
    figure.savefig(path, dpi=80, pil_kwargs={"optimize": True})


if __name__ == "__main__":
    raise SystemExit(main())
