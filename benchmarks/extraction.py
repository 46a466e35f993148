"""Extraction beside OpenCV: localisation of a step under noise, visible edges of rendered bulkheads, time by stage.

    RELMODEL_TEST_DATA=... python benchmarks/extraction.py

Localisation: rms distance (px) of edge elements, and of the points of arcs, from a blurred step at 16 angles, contrast
100, under white noise; what the points say of themselves; what share of the step they cover within 1 px.
Visible edges: F1 within 2 px against sharp and silhouette edges of contrast > 10, inside the part (eroded by 4 px);
Canny at the best of its thresholds for each picture, so its column is a bound, not a setting.  `sure` leaves out arcs
whose texture mark is above 0.5; the ceiling is what an oracle leaves that drops every arc of which less than half is
true.  False arcs: those of which less than half is true, a megapixel, without and with the mark.
"""

import os
from pathlib import Path
from time import perf_counter

import cv2
import numpy as np
import numpy.typing as npt
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree
from scipy.special import ndtr
from tabulate import tabulate

from vision.extraction.edges import edge_elements
from vision.extraction.extract import extract
from vision.images import read_picture

FloatArray = npt.NDArray[np.float64]

PICTURES = ("A/pairs/pair_00", "A/pairs/pair_05", "A/pairs/pair_07", "B/pairs/pair_00", "C/pairs/pair_00")


def localisation() -> None:
    """Rms px of facets at three scales and of Canny refined by a parabola, over signal-to-noise ratios."""
    rng = np.random.default_rng(0)
    rows = []
    for snr in (40.0, 10.0, 5.0, 2.5):
        errors: dict[str, list[FloatArray]] = {}
        predicted: list[FloatArray] = []
        covered: list[float] = []
        for angle in np.linspace(0.05, 2 * np.pi, 16, endpoint=False):
            y, x = np.mgrid[:128, :128] - 63.5
            across = x * np.cos(angle) + y * np.sin(angle) - 0.2
            image = 60 + 100 * ndtr(across / np.hypot(0.7, 12**-0.5)) + rng.normal(0, 100 / snr, (128, 128))
            for scale in (1.4, 2.0, 2.8):
                found = edge_elements(image, scale, min_contrast=40, max_sigma=1.0)
                offset = (found.x - 63.5) * np.cos(angle) + (found.y - 63.5) * np.sin(angle) - 0.2
                near = np.abs(offset) < 2
                errors.setdefault(f"facets {scale}", []).append(offset[near])
            arcs = extract(image).arcs
            offset = (arcs.x - 63.5) * np.cos(angle) + (arcs.y - 63.5) * np.sin(angle) - 0.2
            along = (arcs.y - 63.5) * np.cos(angle) - (arcs.x - 63.5) * np.sin(angle)
            errors.setdefault("points of arcs", []).append(offset[np.abs(offset) < 2])
            predicted.append(arcs.point_sigma[np.abs(offset) < 2])
            gaps = np.abs(np.arange(-45, 46)[:, None] - along[np.abs(offset) < 1]).min(axis=1, initial=np.inf)
            covered.append(float(np.mean(gaps <= 1)))
            place = _canny_with_parabola(image, 2.0)
            offset = (place[:, 0] - 63.5) * np.cos(angle) + (place[:, 1] - 63.5) * np.sin(angle) - 0.2
            errors.setdefault("Canny, parabola 2.0", []).append(offset[np.abs(offset) < 2])
        rms = {name: float(np.sqrt(np.mean(np.concatenate(e) ** 2))) for name, e in errors.items()}
        ratio = float(np.std(np.concatenate(errors["points of arcs"]) / np.concatenate(predicted)))
        rows.append({"SNR": snr, **rms, "scatter / predicted": ratio, "covered": np.mean(covered)})
    print(tabulate(rows, headers="keys", floatfmt=".3f"), "\n")


def _canny_with_parabola(image: FloatArray, sigma: float) -> FloatArray:
    """(n, 2) Canny pixels moved along the gradient to the top of a parabola through three gradient magnitudes."""
    smooth = cv2.GaussianBlur(image, (0, 0), sigma)
    gx, gy = cv2.Sobel(smooth, cv2.CV_64F, 1, 0, scale=1 / 8), cv2.Sobel(smooth, cv2.CV_64F, 0, 1, scale=1 / 8)
    magnitude = np.hypot(gx, gy)
    peak = magnitude.max()
    dx, dy = (np.round(g * 1000 / peak).astype(np.int16) for g in (gx, gy))
    row, column = np.nonzero(cv2.Canny(dx, dy, 300, 600, L2gradient=True))
    inside = (np.minimum(row, column) > 8) & (np.maximum(row, column) < min(image.shape) - 9)
    row, column = row[inside], column[inside]
    nx, ny = gx[row, column] / magnitude[row, column], gy[row, column] / magnitude[row, column]
    m = [map_coordinates(magnitude, [row + t * ny, column + t * nx], order=3) for t in (-1, 0, 1)]
    shift = np.clip(0.5 * (m[0] - m[2]) / np.minimum(m[0] - 2 * m[1] + m[2], -1e-9), -1, 1)
    return np.column_stack([column + shift * nx, row + shift * ny])


def visible_edges(data: Path) -> None:
    """Precision, recall and F1 on pictures of bulkheads, and what of the truth all edge elements see."""
    rows = []
    for name in PICTURES:
        base = data / "bulkhead" / f"{name}_left"
        image = read_picture(f"{base}.png").grey.astype(np.uint8)
        part = (read_picture(f"{base}_faceid.png").grey > 0).astype(np.uint8)
        mask = cv2.erode(part, np.ones((9, 9), np.uint8)) > 0
        mask[:6] = mask[-6:] = mask[:, :6] = mask[:, -6:] = False
        with np.load(f"{base}_edges.npz") as truth:
            seen = np.isin(truth["kind"], (0, 3)) & (np.abs(truth["contrast"]) > 10)
            edges = _inside(truth["uv"][seen].astype(np.float64), mask)
        found = extract(image)
        place = np.column_stack([found.edges.x, found.edges.y])
        members, counts = found.arcs.elements, found.arcs.chains.counts
        true = np.add.reduceat(cKDTree(edges).query(place[members])[0] <= 2, found.arcs.offsets[:-1]) >= 0.5 * counts
        sure = found.marks.texture <= 0.5
        facets = _score(_inside(place[members], mask), edges)
        rid, ceiling = (_score(_inside(place[members[np.repeat(k, counts)]], mask), edges) for k in (sure, true))
        false = [np.sum(~true) * 1e6 / image.size, np.sum(~true & sure) * 1e6 / image.size]
        canny = max((_score(_inside(p, mask), edges) for p in _canny_settings(image)), key=lambda score: score[2])
        everything = _score(_inside(place, mask), edges)
        rows.append([name, *facets, *rid, *canny, ceiling[2], everything[1], *false])
    headers = [
        "picture",
        "arcs P",
        "R",
        "F1",
        "sure P",
        "R",
        "F1",
        "best Canny P",
        "R",
        "F1",
        "ceiling",
        "R of all elements",
    ]
    headers += ["false/MP", "sure"]
    print(tabulate(rows, headers=headers, floatfmt=(".3f",) * 12 + (".0f",) * 2), "\n")


def _canny_settings(image: npt.NDArray[np.uint8]) -> list[FloatArray]:
    places = []
    for sigma in (1.0, 1.5, 2.0, 2.5):
        smooth = cv2.GaussianBlur(image, (0, 0), sigma)
        for low, high in ((10, 30), (20, 50), (30, 75), (40, 100), (50, 125), (75, 175)):
            row, column = np.nonzero(cv2.Canny(smooth, low, high, L2gradient=True))
            places.append(np.column_stack([column, row]).astype(np.float64))
    return places


def _inside(points: FloatArray, mask: npt.NDArray[np.bool_]) -> FloatArray:
    column, row = (np.clip(np.round(points[:, i]).astype(int), 0, mask.shape[1 - i] - 1) for i in (0, 1))
    return np.asarray(points[mask[row, column]])


def _score(found: FloatArray, truth: FloatArray) -> tuple[float, float, float]:
    if len(found) == 0:
        return 0.0, 0.0, 0.0
    precision = float(np.mean(cKDTree(truth).query(found)[0] <= 2))
    recall = float(np.mean(cKDTree(found).query(truth)[0] <= 2))
    return precision, recall, 2 * precision * recall / max(precision + recall, 1e-9)


def times(data: Path) -> None:
    """Milliseconds a megapixel, best of five, by stage; Canny and LSD beside."""
    rows = []
    for name in PICTURES:
        grey = read_picture(data / "bulkhead" / f"{name}_left.png").grey
        megapixels = grey.size / 1e6
        laps = [extract(grey).timings_s for _ in range(5)]
        stages = {stage: min(lap[stage] for lap in laps) * 1e3 / megapixels for stage in laps[0]}
        eight_bit = grey.astype(np.uint8)
        canny, lsd = [], []
        for _ in range(5):
            began = perf_counter()
            cv2.Canny(cv2.GaussianBlur(eight_bit, (0, 0), 2.0), 20, 50, L2gradient=True)
            canny.append((perf_counter() - began) * 1e3 / megapixels)
            began = perf_counter()
            cv2.createLineSegmentDetector().detect(eight_bit)
            lsd.append((perf_counter() - began) * 1e3 / megapixels)
        total = sum(stages.values())
        peers = {"Canny": min(canny), "LSD": min(lsd), "all / LSD": total / min(lsd)}
        rows.append({"ms a megapixel": name, **stages, "all": total, **peers})
    print(tabulate(rows, headers="keys", floatfmt=".1f"))


def main() -> None:
    localisation()
    folder = os.environ.get("RELMODEL_TEST_DATA")
    if folder:
        visible_edges(Path(folder))
        times(Path(folder))


if __name__ == "__main__":
    main()
