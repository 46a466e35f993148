"""Extraction beside OpenCV: localisation of a step under noise, visible edges of rendered bulkheads.

    RELMODEL_TEST_DATA=... python benchmarks/extraction.py

Localisation: rms distance (px) of edge elements, and of the points of arcs, from a blurred step at 16 angles, contrast
100, under white noise; what the points say of themselves; what share of the step they cover within 1 px.
Junctions: rms (px) of their places in sectors that meet at a known place, steps 50 to 150 high, edges of some 35 px,
beside what their covariances say, and the mean of the squared error in its own covariance, which should be one.
Visible edges: F1 within 2 px against sharp and silhouette edges of contrast > 10, inside the part (eroded by 4 px);
Canny at the best of its thresholds for each picture, so its column is a bound, not a setting.  `sure` leaves out arcs
whose texture mark is above 0.5; the ceiling is what an oracle leaves that drops every arc of which less than half is
true.  False arcs: those of which less than half is true, a megapixel, without and with the mark.
Clearing: area under the curve of true against false length, as arcs of all chains are cleared by their number of false
alarms, and by mean contrast times the fourth root of length; false arcs a megapixel before clearing and after, by
either, at the same length of true arcs kept.
Arcs: what share of the visible length of model lines and circles an arc of the right kind covers within 2 px (a circle
seen aslant may be circular or elliptic), what share has an edge element of like direction within 2 px at all, and how
many arcs an edge takes.  Regions: intersection over union of each
visible face with the region that fits it best, weighted by area; the ceilings are what leak-proof regions give on true
edges of contrast > 10, and on all true edges, seen or not."""

import json
import os
from pathlib import Path

import cv2
import numpy as np
import numpy.typing as npt
from scipy.ndimage import map_coordinates
from scipy.spatial import cKDTree
from scipy.special import ndtr
from tabulate import tabulate

from tests.vision.extraction.synthetic import JUNCTIONS, sectors
from vision.cameras.images import read_picture
from vision.extraction.arcs import CIRCULAR, ELLIPTIC, LINE, Arcs
from vision.extraction.edges import EdgeElements, detect_edges
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import EdgeParameters, ExtractionParameters, SignificanceParameters
from vision.extraction.regions import find_leak_proof_regions

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
                found = detect_edges(image, scale, EdgeParameters(min_contrast=40, max_sigma=1.0))
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


def junctions() -> None:
    """Rms px of the places of junctions and what they say of themselves, over the noise."""
    rows = []
    for name, (turns, greys) in JUNCTIONS.items():
        row: list[object] = [name]
        for noise in (5.0, 10.0, 20.0):
            errors, variances, squares = [], [], []
            for seed in range(40):
                rng = np.random.default_rng(seed)
                place, turn = 39.5 + rng.uniform(-2, 2, 2), rng.uniform(0, 2 * np.pi)
                image = sectors((place[0], place[1]), np.deg2rad(turns) + turn, greys, (80, 80))
                found = extract(image + rng.normal(0, noise, image.shape)).junctions
                off = np.column_stack([found.x, found.y]) - place
                near = np.flatnonzero(np.hypot(*off.T) < 3)[:1]
                errors.append(off[near])
                variances.append(np.einsum("nii->n", found.covariance[near]) / 2)
                inverse = np.linalg.inv(found.covariance[near])
                squares.append(np.einsum("ni,nij,nj->n", off[near], inverse, off[near]) / 2)
            error = np.concatenate(errors)
            row += [len(error) / 40, np.sqrt(np.mean(error**2)), np.sqrt(np.mean(np.concatenate(variances)))]
            row.append(np.mean(np.concatenate(squares)))
        rows.append(row)
    headers = [
        "",
        *(f"{what}{noise}" for noise in (5, 10, 20) for what in ("found, noise ", "rms ", "said ", "square ")),
    ]
    print(tabulate(rows, headers=headers, floatfmt=".3f"), "\n")


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
        sure = found.quality.texture <= 0.5
        facets = _score(_inside(place[members], mask), edges)
        rid, ceiling = (_score(_inside(place[members[np.repeat(k, counts)]], mask), edges) for k in (sure, true))
        false = [np.sum(~true) * 1e6 / image.size, np.sum(~true & sure) * 1e6 / image.size]
        canny = max((_score(_inside(p, mask), edges) for p in _canny_settings(image)), key=lambda score: score[2])
        everything = _score(_inside(place, mask), edges)
        rows.append([name, *facets, *rid, *canny, ceiling[2], everything[1], *false])
    headers = ("picture", "arcs P", "R", "F1", "sure P", "R", "F1", "best Canny P", "R", "F1", "ceiling",
               "R of all elements", "false/MP", "sure")  # fmt: skip
    print(tabulate(rows, headers=headers, floatfmt=(".3f",) * 12 + (".0f",) * 2), "\n")


def clearing(data: Path) -> None:
    """How well the number of false alarms tells true arcs from false ones, beside contrast and length."""
    rows = []
    for name in PICTURES:
        base = data / "bulkhead" / f"{name}_left"
        grey = read_picture(f"{base}.png").grey
        faces = read_picture(f"{base}_faceid.png").grey
        parameters = ExtractionParameters()
        found = extract(grey, ExtractionParameters(significance=SignificanceParameters(min_significance=-1e9)))
        with np.load(f"{base}_edges.npz") as truth:
            seen = np.isin(truth["kind"], (0, 3)) & (np.abs(truth["contrast"]) > 5)
            edges = cKDTree(truth["uv"][seen].astype(np.float64))
        arcs, counts = found.arcs, found.arcs.chains.counts
        place = np.column_stack([found.edges.x, found.edges.y])[arcs.elements]
        true = np.add.reduceat(edges.query(place)[0] <= 2, arcs.offsets[:-1]) >= 0.5 * counts
        column, row = np.round(place).astype(int).T
        on_part = np.add.reduceat(faces[row, column] > 0, arcs.offsets[:-1]) >= 0.5 * counts
        scores = arcs.significance, arcs.contrast * counts**0.25
        weight = counts * on_part
        kept = np.sum(weight * true * (arcs.significance >= parameters.significance.min_significance)) / np.sum(
            weight * true
        )
        false = [np.sum(on_part & ~true)]
        areas = []
        for score in scores:
            order = np.argsort(-score, kind="stable")
            hits, misses = np.cumsum(weight[order] * true[order]), np.cumsum(weight[order] * ~true[order])
            areas.append(np.trapezoid(hits / hits[-1], misses / misses[-1]))
            best = order[: int(np.searchsorted(hits, kept * hits[-1])) + 1]
            false.append(np.sum((on_part & ~true)[best]))
        rows.append([name, *areas, kept, *np.array(false) * 1e6 / grey.size])
    headers = ("picture", "AUC of false alarms", "of strength", "true length kept", "false/MP", "cleared",
               "by strength")  # fmt: skip
    print(tabulate(rows, headers=headers, floatfmt=(".3f",) * 4 + (".0f",) * 3), "\n")


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


def arcs_and_regions(data: Path) -> None:
    """Cover and pieces of model lines and circles; agreement of regions with faces."""
    rows = []
    for name in PICTURES:
        base = data / "bulkhead" / f"{name}_left"
        image = read_picture(f"{base}.png").grey
        faces = np.asarray(cv2.imread(f"{base}_faceid.png", cv2.IMREAD_UNCHANGED))
        model = json.loads((data / "bulkhead" / name[0] / "model.json").read_text())
        geometry = {edge["id"]: edge["geom"] for edge in model["edges"]}
        found = extract(image)
        with np.load(f"{base}_edges.npz") as truth:
            edge, place = truth["edge_id"], truth["uv"].astype(np.float64)
            strong = np.abs(truth["contrast"]) > 10
            sharp = (truth["kind"] == 0) & strong
            margin = np.min(np.column_stack([place, np.subtract(image.shape[::-1], 1) - place]), axis=1)
            seen = sharp & (margin > 6)
            normal = truth["normal2d"].astype(np.float64)
            bounds = [_drawn(edge[k], place[k], image.shape) for k in (strong & (truth["kind"] != 1), strong | ~strong)]
        kinds = np.array([geometry.get(int(i), "") for i in edge])
        element = _has_element(found.edges, place, normal)
        line = _cover(found.arcs, place, edge, seen & (kinds == "LINE"), (LINE,))
        circle = _cover(found.arcs, place, edge, seen & (kinds == "CIRCLE"), (CIRCULAR, ELLIPTIC))
        any_line, any_circle = (np.mean(element[seen & (kinds == kind)]) for kind in ("LINE", "CIRCLE"))
        labels = [found.regions.labels, *(find_leak_proof_regions(image, bound).labels for bound in bounds)]
        rows.append([name, *line, any_line, *circle, any_circle, *(_agreement(label, faces) for label in labels)])
    headers = ("picture", "lines covered", "pieces", "seen", "circles covered", "pieces", "seen", "regions IoU",
               "true > 10", "all true")  # fmt: skip
    print(tabulate(rows, headers=headers, floatfmt=".2f"), "\n")


def _cover(
    arcs: Arcs, place: FloatArray, edge: npt.NDArray[np.integer], which: npt.NDArray[np.bool_], kinds: tuple[int, ...]
) -> tuple[float, float]:
    """Share of the samples `which` of edges at least 15 px long within 2 px of an arc of `kinds`; mean arcs an edge."""
    of_point = arcs.chains.chain_of_member
    right = np.isin(arcs.kind[of_point], kinds)
    distance, nearest = cKDTree(np.column_stack([arcs.x, arcs.y])[right]).query(place)
    total, covered, pieces = 0, 0, []
    for i in np.unique(edge[which]):
        own = which & (edge == i)
        if own.sum() < 10 or np.ptp(place[own], axis=0).max() < 15:
            continue
        near = own & (distance <= 2)
        total, covered = total + int(own.sum()), covered + int(near.sum())
        counts = np.bincount(of_point[right][np.asarray(nearest)[near]])
        if np.any(counts >= 0.05 * own.sum()):
            pieces.append(int(np.sum(counts >= 0.05 * own.sum())))
    return covered / max(total, 1), float(np.mean(pieces)) if pieces else 0.0


def _has_element(edges: EdgeElements, place: FloatArray, normal: FloatArray) -> npt.NDArray[np.bool_]:
    """Whether each sample has an edge element across the same direction within 2 px."""
    distance, near = cKDTree(np.column_stack([edges.x, edges.y])).query(place, k=6, distance_upper_bound=2.0)
    at = np.minimum(near, len(edges) - 1)
    alike = np.abs(edges.nx[at] * normal[:, :1] + edges.ny[at] * normal[:, 1:]) > 0.8
    return np.asarray((np.isfinite(distance) & alike).any(axis=1))


def _drawn(edge: npt.NDArray[np.integer], place: FloatArray, shape: tuple[int, ...]) -> npt.NDArray[np.bool_]:
    """Samples of edges joined to polylines where they follow on each other within 6 px."""
    canvas = np.zeros(shape, np.uint8)
    corners = np.round(place).astype(np.int32)
    follows = (np.diff(edge) == 0) & (np.hypot(*np.diff(place, axis=0).T) < 6)
    segments = np.stack([corners[:-1][follows], corners[1:][follows]], axis=1)
    cv2.polylines(canvas, list(segments), False, 1, 1)
    return canvas > 0


def _agreement(labels: npt.NDArray[np.int32], faces: npt.NDArray[np.generic]) -> float:
    face = faces.astype(np.int64)
    count = int(labels.max()) + 1
    both = (face > 0) & (labels >= 0)
    pair, shared = np.unique_counts(face[both] * count + labels[both])
    face_area, region_area = np.bincount(face[face > 0]), np.bincount(labels[labels >= 0], minlength=count)
    union = face_area[pair // count] + region_area[pair % count] - shared
    best = np.zeros(len(face_area))
    np.maximum.at(best, pair // count, shared / union)
    return float(np.sum(best * face_area) / np.sum(face_area))


def main() -> None:
    localisation()
    junctions()
    folder = os.environ.get("RELMODEL_TEST_DATA")
    if folder:
        visible_edges(Path(folder))
        clearing(Path(folder))
        arcs_and_regions(Path(folder))


if __name__ == "__main__":
    main()
