"""Look at the demonstration's pictures: overlays of the visible model edges, and how far the picture's edges lie off.

    python -m examples.render.look FOLDER [--demo examples/demo] [NN ...]

Run from the root of the checkout; needs the extra `step`, not the renderer.
"""

from __future__ import annotations

import argparse
from pathlib import Path

import cv2
import numpy as np
from numpy.typing import NDArray

from examples.render.model import Component, read_components
from examples.render.truth import Caster, visible_edges
from examples.render.views import VIEWS, shot

Array = NDArray[np.float64]


def edge_offsets(image: NDArray[np.uint8], edges: list[tuple[Array, Array]], reach: int = 3) -> tuple[int, Array]:
    """Signed x, y offsets (median over samples) from projected edges to the steepest gradient across them.

    Samples count where the picture changes by more than 40 grey values within `reach` pixels, off its border.
    """
    points, normals = (np.concatenate(a) for a in zip(*edges, strict=True))
    clear = ((points > 12) & (points < np.array(image.shape[::-1]) - 13)).all(1)
    points, normals = points[clear], normals[clear]
    steps = np.arange(-reach, reach + 0.01, 0.25)
    at = points[:, None] + steps[None, :, None] * normals[:, None]
    x, y = np.moveaxis(at, 2, 0).astype(np.float32)
    profile = cv2.remap(image.astype(np.float32), x, y, cv2.INTER_CUBIC)
    slope = np.abs(np.gradient(profile, axis=1))
    peak = slope.argmax(1)
    good = (np.ptp(profile, axis=1) > 40) & (peak > 0) & (peak < len(steps) - 1)
    row, peak = np.flatnonzero(good), peak[good]
    before, at_peak, after = slope[row, peak - 1], slope[row, peak], slope[row, peak + 1]
    finer = (before - after) / (2 * np.minimum(before - 2 * at_peak + after, -1e-9))
    offset = (steps[peak] + 0.25 * np.clip(finer, -0.5, 0.5))[:, None] * normals[good]
    return int(good.sum()), np.median(offset, axis=0)


def look(folder: Path, demo: Path, number: str, components: list[Component]) -> None:
    """Write both overlays of a pair and print a line of edge offsets for each."""
    view, caster = shot(VIEWS[number]), Caster(components)
    for side, camera in view.cameras.items():
        image = np.asarray(cv2.imread(str(demo / f"pair_{number}_{side}.png"), cv2.IMREAD_GRAYSCALE), np.uint8)
        edges = visible_edges(caster, components, camera, view.poses[side])
        count, (dx, dy) = edge_offsets(image, edges)
        share = float((image == 255).mean())
        print(f"{number} {side}: {len(edges)} edges, {count} samples, {dx:+.3f} {dy:+.3f} px, {share:.1%} white")
        drawn = cv2.cvtColor(image, cv2.COLOR_GRAY2BGR)
        for x, y in np.concatenate([points for points, _ in edges]):
            cv2.circle(drawn, (round(x * 16), round(y * 16)), 12, (0, 0, 255), -1, cv2.LINE_AA, 4)
        cv2.imwrite(str(folder / f"overlay_{number}_{side}.png"), drawn)


def main() -> None:
    arguments = argparse.ArgumentParser(description="Overlay the model's visible edges on the pictures.")
    arguments.add_argument("folder", type=Path)
    arguments.add_argument("pairs", nargs="*", default=list(VIEWS))
    arguments.add_argument("--demo", type=Path, default=Path("examples/demo"))
    options = arguments.parse_args()
    options.folder.mkdir(parents=True, exist_ok=True)
    models: dict[str, list[Component]] = {}
    for number in options.pairs:
        variant = VIEWS[number].variant
        if variant not in models:
            models[variant] = read_components(options.demo / f"bulkhead_{variant}.step.gz", edges=True)
        look(options.folder, options.demo, number, models[variant])


if __name__ == "__main__":
    main()
