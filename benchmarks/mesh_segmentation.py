"""Surfaces and arcs found in tessellations, beside the faces and edges of the B-rep that they were made from.

    RELMODEL_TEST_DATA=... python benchmarks/mesh_segmentation.py [--held-out | --splined] [--parts]

The kernel tessellates real parts, and parts composed of cones, spheres, tori and blends, to several deflections;
coordinates are rounded to single precision as STL holds them.  --held-out: parts, seeds and deflections that nobody
looked at while the cutting was written.  --splined: composed parts of lofts, sweeps, extruded and revolved splines
instead.  --parts: a table of the parts, too.

Truth: faces, those of one surface that meet taken together.  A face is found, and a surface true, where kinds are
equal and the triangles of both have 0.8 of their common area; facets are free-form.  False cylinders are those whose
triangles are, for the greater part of their area, of faces of another kind.  Arcs by length: samples of an edge (not
within a face) are found where an arc of that kind runs along within twice the chord, and the other way round.  Edges
that keep within 2 micrometres of a line, circle or ellipse are that, all others are free.
"""

import os
import sys
from collections import Counter
from collections.abc import Callable, Iterator
from pathlib import Path
from time import process_time
from typing import Any

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree
from tabulate import tabulate

sys.path.insert(0, str(Path(__file__).parents[1]))  # for the tests' generator

from relmodel.geometry.clusters import components
from relmodel.geometry.curves import vectors
from relmodel.model.model import Shape
from relmodel.readers.mesh.shape import shape_from_triangles
from relmodel.readers.step import shape as step_shape
from relmodel.readers.step.read import read_step
from tests.parts import curved_parts, splined_parts
from tests.parts.tessellations import meshed_by_kernel

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]
Names = npt.NDArray[np.str_]

PARTS: tuple[str, ...] = (
    "step/featuretype.STEP",
    "step/2-2-3-3-10-23.step",
    "step/3-3-3-3-3-23.step",
    "step/M6-1x12-countersunk-screw.step",
    "step/conical-surface.step",
    "step/screw.step",
    "step/base_interface_AP214.STEP",
    "step/nist_ctc_01_asme1_ap203.stp",
    "step/nist_ctc_02_asme1_ap242.stp",
    "step/nist_ctc_04_asme1_ap203.stp",
    "step/box_sides.STEP",
    "step/dm1-oc-214.stp",
    "bulkhead/A/bulkhead_parts.step",
    "bulkhead/C/bulkhead_parts.step",
)
HELD_PARTS = (
    *PARTS,
    "step/as1-tu-203.stp",
    "step/io1-tu-203.stp",
    "step/sg1-c5-214.stp",
    "step/red_cube_blue_cylinder.step",
    "bulkhead/B/bulkhead_parts.step",
)
SEEDS, HELD_SEEDS = range(20), range(100, 120)
DEFLECTIONS = ((0.1, 0.3), (0.05, 0.15), (0.3, 0.4))  # mm, rad
HELD_DEFLECTIONS = ((0.02, 0.1), (0.15, 0.2), (0.2, 0.35))
SPLINED_SEEDS, SPLINED_DEFLECTIONS = range(300, 330), ((0.07, 0.25), (0.03, 0.5), (0.5, 0.2))
KINDS = ("plane", "cylinder", "cone", "sphere", "torus", "facets")
CURVES = ("line", "circle", "ellipse", "free")
OVERLAP = 0.8
NEAR_MM, NEAR_RAD = 2e-3, 1e-4
LEAST_TURN, LEAST_SAMPLES = 0.5, 8  # rad, of a spline that may be an ellipse
ALONG_MM, ALONG_COSINE = 1.0, 0.94  # samples of an edge and of an arc along it


def merged_faces(shape: Shape) -> tuple[Ints, Names]:
    """Label of each face, one for those of a surface that meet, and the kind of each label."""
    s = shape.surfaces
    kind = np.asarray(s["recognised_kind"]).astype("U10")
    origin, axis = vectors(s, "origin"), vectors(s, "axis_z")
    size = np.stack([np.asarray(s[c], float) for c in ("radius", "radius2")], axis=1)
    semi = np.abs(np.asarray(s["semi_angle"], float))
    a, b = np.asarray(shape.arcs["surface_a"]), np.asarray(shape.arcs["surface_b"])
    met = (a >= 0) & (b >= 0)
    a, b = a[met], b[met]
    arm = origin[a] - origin[b]
    aligned = np.linalg.norm(np.cross(axis[a], axis[b]), axis=1) < NEAR_RAD
    along = np.sum(arm * axis[a], axis=1)
    beside = np.linalg.norm(arm - along[:, None] * axis[a], axis=1) < NEAR_MM
    equal = np.all(np.nan_to_num(np.abs(size[a] - size[b])) < NEAR_MM, axis=1)
    same = np.select(
        [kind[a] == k for k in KINDS[:5]],
        [
            aligned & (np.abs(along) < NEAR_MM),
            aligned & beside & equal,
            aligned & beside & (np.abs(semi[a] - semi[b]) < NEAR_RAD),
            equal & (np.linalg.norm(arm, axis=1) < NEAR_MM),
            aligned & beside & equal & (np.abs(along) < NEAR_MM),
        ],
        False,
    )
    same &= kind[a] == kind[b]
    label = components(len(kind), a[same], b[same])
    swept = shape.surface_swept
    if swept:  # a revolved circle; the profile of a face lies in a plane with the axis
        curve, number = np.asarray(swept["basis_arc"]), np.asarray(swept["surface_no"])
        round_ = (curve >= 0) & (kind[number] == "revolution")
        round_[round_] = np.asarray(shape.basis_arcs["recognised_kind"])[curve[round_]] == "circle"
        kind[number[round_]] = "torus"
    kinds = np.empty(label.max() + 1, "U10")
    kinds[label] = np.where(np.isin(kind, KINDS), kind, "facets")
    return label, kinds


def score(truth: Shape, found: Shape, label: Ints, kinds: Names, chord: float) -> Counter[tuple[str, str]]:
    """Counts (kind, "faces", "found", "surfaces", "true", "false") and lengths ("edge mm" …, "arc mm" …)."""
    out: Counter[tuple[str, str]] = Counter()
    corner = found.mesh.vertices[found.mesh.triangles]
    area = np.linalg.norm(np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0]), axis=1)
    near = cKDTree(truth.mesh.vertices[truth.mesh.triangles].mean(axis=1)).query(corner.mean(axis=1))[1]
    of_face = label[truth.mesh.triangle_surfaces[near]]
    of_surface = found.mesh.triangle_surfaces.astype(np.int64)
    found_kind = np.asarray(found.surfaces["kind"])
    pair, inverse = np.unique(of_face * np.int64(len(found_kind)) + of_surface, return_inverse=True)
    common = np.bincount(inverse, area)
    face, surface = np.divmod(pair, len(found_kind))
    total_a, total_b = np.bincount(of_face, area, len(kinds)), np.bincount(of_surface, area, len(found_kind))
    good = common >= OVERLAP * (total_a[face] + total_b[surface] - common)
    good &= kinds[face] == found_kind[surface]
    alike = np.bincount(surface, np.where(kinds[face] == found_kind[surface], common, 0.0), len(found_kind))
    for kind in KINDS:
        out[kind, "faces"] += int(np.sum((kinds == kind) & (total_a > 0)))
        out[kind, "found"] += int(np.sum(kinds[face[good]] == kind))
        out[kind, "surfaces"] += int(np.sum(found_kind == kind))
        out[kind, "true"] += int(np.sum(found_kind[surface[good]] == kind))
        out[kind, "false"] += int(np.sum((found_kind == kind) & (alike < total_b / 2)))
    a, b = np.asarray(truth.arcs["surface_a"]), np.asarray(truth.arcs["surface_b"])
    inside = (a >= 0) & (b >= 0) & (label[a] == label[b])
    edges = _samples(truth, np.where(inside, "", edge_kinds(truth)))
    arcs = _samples(found, _curve_kinds(found.arcs["kind"]))
    for name, one, other in (("edge mm", edges, arcs), ("arc mm", arcs, edges)):
        for kind in CURVES:
            points, tangents, length = one[kind]
            out[kind, name] += length.sum()
            out[kind, name + " right"] += length[_runs_along(points, tangents, *other[kind][:2], chord)].sum()
    return out


def edge_kinds(shape: Shape) -> Names:
    """Kind of each exact edge; free ones that keep within NEAR_MM of a line, circle or ellipse are that."""
    kinds = _curve_kinds(shape.arcs["recognised_kind"])
    samples = shape.samples
    for arc, begin, end in zip(samples.arc_no, samples.points.offsets[:-1], samples.points.offsets[1:], strict=True):
        points = samples.points.values[begin:end].reshape(-1, 3)
        if kinds[arc] == "free" and len(points) >= LEAST_SAMPLES:
            tangents = samples.tangents.values[begin:end].reshape(-1, 3)
            turns = np.arccos(np.clip(np.sum(tangents[1:] * tangents[:-1], axis=1), -1, 1)).sum()
            away = _away(points)
            kinds[arc] = next(
                (
                    kind
                    for kind, least in (("line", 0.0), ("circle", LEAST_TURN), ("ellipse", LEAST_TURN))
                    if turns >= least and away[kind] < NEAR_MM
                ),
                "free",
            )
    return kinds


def _away(points: Floats) -> dict[str, float]:
    """Greatest distance of points (n, 3) from the line, circle and ellipse through them, from the last to first order
    and infinite where there is none."""
    arm = points - points.mean(axis=0)
    local = arm @ np.linalg.svd(arm, full_matrices=False)[2].T
    size = np.abs(local).max()
    x, y = local[:, 0] / size, local[:, 1] / size
    one, off_plane = np.ones(len(x)), np.abs(local[:, 2]).max()
    out = {"line": np.linalg.norm(local[:, 1:], axis=1).max(), "ellipse": np.inf}
    p, q, r = np.linalg.lstsq(np.stack([x, y, one], axis=1), x * x + y * y, rcond=None)[0]
    out["circle"] = size * np.abs(np.hypot(x - p / 2, y - q / 2) - np.sqrt(r + (p * p + q * q) / 4)).max() + off_plane
    a, b, c, d, e, f = np.linalg.svd(np.stack([x * x, x * y, y * y, x, y, one], axis=1))[2][-1]
    if b * b < 4 * a * c:
        slope = np.hypot(2 * a * x + b * y + d, b * x + 2 * c * y + e)
        out["ellipse"] = (
            size * (np.abs(a * x * x + b * x * y + c * y * y + d * x + e * y + f) / slope).max() + off_plane
        )
    return out


def _curve_kinds(kind: object) -> Names:
    kinds = np.asarray(kind).astype("U12")
    return np.where(np.isin(kinds, CURVES), kinds, "free")


def _samples(shape: Shape, kinds: Names) -> dict[str, tuple[Floats, Floats, Floats]]:
    """Of each kind the samples of its arcs: points, tangents, and the length that each stands for."""
    samples = shape.samples
    number = np.repeat(samples.arc_no, np.diff(samples.points.offsets) // 3)
    length = np.asarray(shape.arcs["length"], float)[number] / np.bincount(number)[number]
    points, tangents = samples.points.values.reshape(-1, 3), samples.tangents.values.reshape(-1, 3)
    rows = {kind: kinds[number] == kind for kind in CURVES}
    return {kind: (points[r], tangents[r], length[r]) for kind, r in rows.items()}


def _runs_along(p: Floats, along: Floats, q: Floats, other: Floats, chord: float) -> npt.NDArray[np.bool_]:
    """Whether a curve with samples q runs along beside each of the samples p."""
    if not len(p) or not len(q):
        return np.zeros(len(p), bool)
    near = np.minimum(cKDTree(q).query(p, 8, distance_upper_bound=ALONG_MM + 2 * chord)[1], len(q) - 1)
    arm = q[near] - p[:, None]
    reach = np.sum(arm * along[:, None], axis=2)
    beside = np.linalg.norm(arm - reach[..., None] * along[:, None], axis=2)
    parallel = np.abs(np.sum(other[near] * along[:, None], axis=2)) > ALONG_COSINE
    return np.asarray(np.any((beside <= 2 * chord) & (np.abs(reach) <= ALONG_MM) & parallel, axis=1), bool)


def bodies(
    parts: tuple[str, ...], seeds: range, generate: Callable[[int], Any] = curved_parts.generate
) -> Iterator[tuple[str, list[Shape]]]:
    """Name and exact shapes, tessellated, of the files and of the composed parts."""
    folder = Path(os.environ.get("RELMODEL_TEST_DATA", ""))
    for name in parts if "RELMODEL_TEST_DATA" in os.environ else ():
        shapes = [shape for shape in read_step(folder / name).shapes if len(shape.mesh.triangles)]
        yield name.split("/")[-1][:24] if "step/" in name else name[:10], shapes
    for seed in seeds:
        yield f"composed {seed}", [step_shape.extract(generate(seed), {}, {}, {})]


def main() -> None:
    parts, seeds, deflections = PARTS, SEEDS, DEFLECTIONS
    generate = curved_parts.generate
    if "--held-out" in sys.argv:
        parts, seeds, deflections = HELD_PARTS, HELD_SEEDS, HELD_DEFLECTIONS
    elif "--splined" in sys.argv:
        parts, seeds, generate, deflections = (), SPLINED_SEEDS, splined_parts.generate, SPLINED_DEFLECTIONS
    tetrahedron = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    began = process_time()
    shape_from_triangles(tetrahedron, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))
    print(f"compiling or loading the kernels: {process_time() - began:.1f} s of CPU\n")
    everything = Counter[tuple[str, str]]()
    for chord, angle in deflections:
        rows, total, triangles, seconds = [], Counter[tuple[str, str]](), 0, 0.0
        with meshed_by_kernel(chord, angle):
            bodies_of_parts = list(bodies(parts, seeds, generate))
        for name, shapes in bodies_of_parts:
            one, began = Counter[tuple[str, str]](), seconds
            for truth in shapes:
                vertices = truth.mesh.vertices.astype(np.float32).astype(float)
                start = process_time()
                found = shape_from_triangles(vertices, truth.mesh.triangles.astype(np.int64))
                seconds += process_time() - start
                assert found is not None
                triangles += len(found.mesh.triangles)
                one += score(truth, found, *merged_faces(truth), chord)
            row = {"part": name, "s": seconds - began}
            row |= {k: f"{one[k, 'found']}/{one[k, 'faces']} {one[k, 'true']}/{one[k, 'surfaces']}" for k in KINDS}
            rows.append(row | {"false cylinders": one["cylinder", "false"]})
            total += one
        if "--parts" in sys.argv:
            print(tabulate(rows, headers="keys", floatfmt=".2f"), "\n")
        print(f"{chord} mm, {angle} rad: {triangles} triangles in {seconds:.1f} s of CPU")
        print_ratios(total)
        everything += total
    print("all deflections")
    print_ratios(everything)


def print_ratios(total: Counter[tuple[str, str]]) -> None:
    ratios: list[dict[str, object]] = []
    for k in KINDS:
        recall, precision = (total[k, x] / max(total[k, y], 1) for x, y in (("found", "faces"), ("true", "surfaces")))
        ratios.append(
            {
                "kind": k,
                "truth": total[k, "faces"],
                "recall": recall,
                "precision": precision,
                "false": total[k, "false"],
            }
        )
    for k in CURVES:
        recall, precision = (total[k, f"{n} mm right"] / max(total[k, f"{n} mm"], 1) for n in ("edge", "arc"))
        ratios.append({"kind": k, "truth": f"{total[k, 'edge mm']:.0f} mm", "recall": recall, "precision": precision})
    print(tabulate(ratios, headers="keys", floatfmt=".3f"), "\n")


if __name__ == "__main__":
    main()
