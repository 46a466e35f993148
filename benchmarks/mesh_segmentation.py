"""Surfaces and arcs found in tessellations, beside the faces and edges of the B-rep that they were made from.

    RELMODEL_TEST_DATA=... python benchmarks/mesh_segmentation.py [--fine]

The kernel tessellates the parts (0.1 mm, 0.3 rad; --fine: 0.05 mm, 0.15 rad), coordinates are rounded to single
precision as STL holds them.  Truth: faces, those of one surface that meet taken together.  A face is found, and a
surface true, where kinds are equal and the triangles of both have 0.8 of their common area; facets are free-form.
Arcs by length: samples of an edge (not within a face, of a known kind) are found where an arc of that kind passes
within the chord, and the other way round.
"""

import os
import sys
from collections import Counter
from pathlib import Path
from time import perf_counter

import numpy as np
import numpy.typing as npt
from scipy.spatial import cKDTree
from tabulate import tabulate

from relmodel.geometry.curves import vectors
from relmodel.loading import step_document, step_shape
from relmodel.loading.facets import shape_from_triangles
from relmodel.loading.neutral import Shape
from relmodel.loading.regions import components

Floats = npt.NDArray[np.float64]
Ints = npt.NDArray[np.int64]

PARTS = (
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
KINDS = ("plane", "cylinder", "cone", "sphere", "torus", "facets")
CURVES = ("line", "circle", "ellipse")
OVERLAP = 0.8
NEAR_MM, NEAR_RAD = 2e-3, 1e-4


def merged_faces(shape: Shape) -> tuple[Ints, npt.NDArray[np.str_]]:
    """Label of each face, one for those of a surface that meet, and the kind of each label."""
    s = shape.surfaces
    kind = np.asarray(s["recognised_kind"]).astype("U9")
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
    kinds = np.empty(label.max() + 1, "U9")
    kinds[label] = np.where(np.isin(kind, KINDS), kind, "facets")
    return label, kinds


def score(
    truth: Shape, found: Shape, label: Ints, kinds: npt.NDArray[np.str_], chord: float
) -> Counter[tuple[str, str]]:
    """Counts (kind, "faces", "faces found", "surfaces", "surfaces true") and lengths ("edges" …, "arcs" …)."""
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
    for kind in KINDS:
        out[kind, "faces"] += int(np.sum((kinds == kind) & (total_a > 0)))
        out[kind, "found"] += int(np.sum(kinds[face[good]] == kind))
        out[kind, "surfaces"] += int(np.sum(found_kind == kind))
        out[kind, "true"] += int(np.sum(found_kind[surface[good]] == kind))
    a, b = np.asarray(truth.arcs["surface_a"]), np.asarray(truth.arcs["surface_b"])
    inside = (a >= 0) & (b >= 0) & (label[a] == label[b])
    true_kind = np.where(inside, "", np.asarray(truth.arcs["recognised_kind"]).astype("U12"))
    sides = ((truth, true_kind, "edge mm"), (found, np.asarray(found.arcs["kind"]).astype("U12"), "arc mm"))
    points = {}
    for shape, arc_kind, name in sides:
        samples = shape.samples
        number = np.repeat(samples.arc_no, np.diff(samples.points.offsets) // 3)
        length = np.asarray(shape.arcs["length"], float)[number] / np.bincount(number)[number]
        points[name] = samples.points.values.reshape(-1, 3), arc_kind[number], length
    for kind in CURVES:
        chosen = {name: (p[k == kind], w[k == kind]) for name, (p, k, w) in points.items()}
        for name, other in (("edge mm", "arc mm"), ("arc mm", "edge mm")):
            p, w = chosen[name]
            q = chosen[other][0]
            away = cKDTree(q).query(p)[0] if len(p) and len(q) else np.full(len(p), np.inf)
            out[kind, name] += w.sum()
            out[kind, name + " right"] += w[away < 1.0 + chord].sum()
    return out


def main() -> None:
    chord, angle = (0.05, 0.15) if "--fine" in sys.argv else (0.1, 0.3)
    step_shape.CHORD_MM, step_shape.CHORD_RAD = chord, angle
    folder = Path(os.environ["RELMODEL_TEST_DATA"])
    tetrahedron = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    shape_from_triangles(tetrahedron, np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]]))  # compiles
    rows, total = [], Counter[tuple[str, str]]()
    for name in PARTS:
        one, triangles, seconds = Counter[tuple[str, str]](), 0, 0.0
        for truth in step_document.read(str(folder / name)).shapes:
            vertices = truth.mesh.vertices.astype(np.float32).astype(float)
            began = perf_counter()
            found = shape_from_triangles(vertices, truth.mesh.triangles.astype(np.int64))
            seconds += perf_counter() - began
            assert found is not None
            triangles += len(found.mesh.triangles)
            one += score(truth, found, *merged_faces(truth), chord)
        row = {"part": Path(name).name[:24] if "step/" in name else name[:10], "triangles": triangles, "s": seconds}
        row |= {k: f"{one[k, 'found']}/{one[k, 'faces']} {one[k, 'true']}/{one[k, 'surfaces']}" for k in KINDS}
        rows.append(row)
        total += one
    print(tabulate(rows, headers="keys", floatfmt=".2f"), "\n")
    ratios: list[dict[str, object]] = []
    for k in KINDS:
        recall, precision = (total[k, x] / max(total[k, y], 1) for x, y in (("found", "faces"), ("true", "surfaces")))
        ratios.append({"kind": k, "truth": total[k, "faces"], "recall": recall, "precision": precision})
    for k in CURVES:
        recall, precision = (total[k, f"{n} mm right"] / max(total[k, f"{n} mm"], 1) for n in ("edge", "arc"))
        ratios.append({"kind": k, "truth": f"{total[k, 'edge mm']:.0f} mm", "recall": recall, "precision": precision})
    print(tabulate(ratios, headers="keys", floatfmt=".3f"))


if __name__ == "__main__":
    main()
