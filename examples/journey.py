"""What stands in for your own part and pictures in `journey.sh`: a bracket, of which one was made with a bore too wide.
`python -m examples.journey FOLDER` writes part.step, world.yaml, rig.yaml, prior.yaml, left.png and right.png."""

import sys
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

from relmodel.arrays import Bytes, Floats
from relmodel.geometry.rays import Rays


def cast(rays: Rays, grey: Floats, size: tuple[int, int], k: Floats, pose: Floats, seed: int) -> Bytes:
    """Triangles, each of one grey, as a camera of matrix k shows them: nine rays a pixel, PSF .7 px, noise of 2."""
    fine = (np.arange(3) - 1) / 3
    grid = np.stack(np.meshgrid(*((np.arange(n)[:, None] + fine).ravel() for n in size)), axis=-1).reshape(-1, 2)
    ways = np.column_stack([(grid - k[:2, 2]) / [k[0, 0], k[1, 1]], np.ones(len(grid))]) @ pose[:3, :3].T
    hit = rays.nearest(pose[:3, 3], ways)
    mean = np.where(hit >= 0, grey[hit], 20.0).reshape(size[1], 3, size[0], 3).mean(axis=(1, 3))
    noise = np.random.default_rng(seed).normal(0, 2, mean.shape)
    return np.asarray(np.clip(np.rint(gaussian_filter(mean, 0.7) + noise), 0, 255), np.uint8)


def main(folder: Path, seed: int = 1) -> None:
    from examples.render.draws import draw_table_view
    from examples.render.families import changes, draw, make
    from examples.render.files import EXACT, write_prior, write_rig, write_world
    from examples.render.objects import write_step
    from examples.render.strangers import components_of

    folder.mkdir(parents=True, exist_ok=True)
    design = draw("bracket", seed)
    change, made = next(changes(design, "resized", np.random.default_rng(seed)))
    body = components_of(made)[0].part
    view = draw_table_view(seed, (800, 600), body.vertices, 2, (0.6, 0.7))
    write_step(make(design), folder / "part.step")
    write_world(folder / "world.yaml", "cell", {"object": "bracket", "name": "bracket"}, np.eye(4), "On the table.")
    write_rig(folder / "rig.yaml", view, EXACT)
    write_prior(folder / "prior.yaml", view, np.eye(4), seed, 10.0, 3.0)
    a, b, c = np.moveaxis(body.vertices[body.triangles], 1, 0)
    normal = np.cross(b - a, c - a)
    grey = 30 + 160 * np.abs(normal @ [0.25, 0.5, 0.83]) / np.linalg.norm(normal, axis=1)
    for side, camera in view.cameras.items():
        seen = cast(Rays(body.vertices, body.triangles), grey, camera.size, camera.matrix, view.poses[side], seed)
        Image.fromarray(seen).save(folder / f"{side}.png")
    print(f"{change.name} is {change.amount:+.1f} mm")


if __name__ == "__main__":
    main(Path(sys.argv[1]))
