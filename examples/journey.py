"""What stands in for your own part and pictures in `journey.sh`: a bracket, of which one was made with a bore too wide.
`python -m examples.journey FOLDER` writes part.step, world.yaml, rig.yaml, prior.yaml, left.png and right.png."""

import sys
from dataclasses import replace
from pathlib import Path

import numpy as np
from PIL import Image
from scipy.ndimage import gaussian_filter

from examples.render.draws import draw_table_view
from examples.render.families import changes, draw, make
from examples.render.files import EXACT, write_prior, write_rig, write_world
from examples.render.objects import write_step
from examples.render.strangers import components_of
from examples.render.truth import Caster, pixel_rays
from examples.render.views import Shot

SEED, WIDTH, HEIGHT = 1, 960, 720


def picture(caster: Caster, view: Shot, side: str) -> Image.Image:
    """What a camera shows of a matt part: nine rays a pixel, a blur of .7 px, noise of 2 grey values."""
    camera, pose = view.cameras[side], view.poses[side]
    middle = 3 * camera.centre[0] + 1, 3 * camera.centre[1] + 1
    fine = replace(camera, focal=3 * camera.focal, centre=middle, size=(3 * WIDTH, 3 * HEIGHT))
    rays = np.asarray(pixel_rays(fine) @ pose[:3, :3].T, np.float32)
    met = caster.scene.run(np.broadcast_to(pose[:3, 3], rays.shape).astype(np.float32), rays, output=1)["primID"]
    corners = caster.vertices[0][caster.triangles[0]]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    shade = np.abs(normal @ [0.25, 0.5, 0.83]) / np.linalg.norm(normal, axis=1)
    grey = np.where(met < 0, 25.0, 30 + 160 * shade[met]).reshape(HEIGHT, 3, WIDTH, 3).mean(axis=(1, 3))
    seen = gaussian_filter(grey, 0.7) + np.random.default_rng(SEED).normal(0, 2, grey.shape)
    return Image.fromarray(np.clip(seen, 0, 255).astype(np.uint8))


if __name__ == "__main__":
    folder = Path(sys.argv[1])
    folder.mkdir(parents=True, exist_ok=True)
    design = draw("bracket", SEED)
    change, made = next(changes(design, "resized", np.random.default_rng(SEED)))
    caster = Caster(components_of(made))
    view = draw_table_view(SEED, (WIDTH, HEIGHT), caster.vertices[0], 2, (0.5, 0.6))
    write_step(make(design), folder / "part.step")
    write_world(folder / "world.yaml", "cell", {"object": "bracket", "name": "bracket"}, np.eye(4), "On the table.")
    write_rig(folder / "rig.yaml", view, EXACT)
    write_prior(folder / "prior.yaml", view, np.eye(4), SEED, 10.0, 3.0)
    for side in view.cameras:
        picture(caster, view, side).save(folder / f"{side}.png")
    print(f"{change.name} is {change.amount:+.1f} mm")
