"""Arcs in photographs of a wooden cube, and in rendered pictures of a box, against the edges of their models."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
import trimesh

from relmodel.arrays import Floats
from vision.cameras.images import read_picture
from vision.extraction.extract import Extraction, extract


def seen_edges(mesh: trimesh.Trimesh, camera_from_object: Floats, matrix: Floats, outline: bool) -> Floats:
    """Ends (n, 2, 2), px, of the sharp edges of a convex body that bound a face turned to the camera, or just one."""
    away = mesh.face_normals @ camera_from_object[:3, :3].T
    middle = mesh.triangles_center @ camera_from_object[:3, :3].T + camera_from_object[:3, 3]
    seen = np.einsum("nd,nd->n", away, middle) < 0
    beside = seen[mesh.face_adjacency]
    sharp = (mesh.face_adjacency_angles > 0.5) & beside.any(axis=1) & ~(outline & beside.all(axis=1))
    ends = mesh.vertices[mesh.face_adjacency_edges[sharp]] @ camera_from_object[:3, :3].T + camera_from_object[:3, 3]
    pixels = ends @ matrix.T
    return np.asarray(pixels[..., :2] / pixels[..., 2:])


def found_share(extraction: Extraction, edges: Floats, within: float) -> float:
    """Share of the length of edges, inside the picture, that points of arcs which run the same way lie near to."""
    arcs = extraction.arcs
    members = arcs.chains.elements
    points = np.column_stack([extraction.edges.x, extraction.edges.y])[members]
    across = np.column_stack([extraction.edges.nx, extraction.edges.ny])[members]
    height, width = extraction.shape
    near = total = 0
    for a, b in edges:
        length = float(np.linalg.norm(b - a))
        along = (b - a) / length
        side = np.array([-along[1], along[0]])
        at = a + np.linspace(0, 1, int(length) + 2)[:, None] * (b - a)
        at = at[np.all((at > 5) & (at < np.array([width, height]) - 6), axis=1)]
        like = points[(np.abs((points - a) @ side) < within) & (np.abs(across @ side) > 0.9)]
        total += len(at)
        if len(like):
            near += int(np.sum(np.abs((at - a) @ along - ((like - a) @ along)[:, None]).min(axis=0) < 2.0))
    return near / total


@pytest.mark.data
@pytest.mark.parametrize(
    ("name", "outline", "within", "least"),
    [
        ("render_box", False, 1.5, 0.9),
        # Pictures are glued to its faces, and its poses are fitted; one side is as bright as the ground.
        ("photo_cube", True, 3.0, 0.8),
    ],
)
def test_edges_of_the_body_are_found(data_dir: Path, name: str, outline: bool, within: float, least: float) -> None:
    described = json.loads((data_dir / name / "frames.json").read_text())
    body = trimesh.load_mesh(data_dir / name / "model.obj").split(only_watertight=False)[0]
    shares = []
    for frame in described["frames"][::6]:
        matrix, pose = np.array(frame["K"], float), np.array(frame["camera_from_object"], float)
        extraction = extract(read_picture(data_dir / name / frame["image"]).grey)
        shares.append(found_share(extraction, seen_edges(body, pose, matrix, outline), within))
    assert np.mean(shares) > least
