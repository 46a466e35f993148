"""Scenes of boxes with closed-form edges, and pictures of them by ray casting."""

from __future__ import annotations

import numpy as np

from examples.journey import cast
from relmodel.arrays import Bytes, Floats, Ints
from vision.cameras.cameras import CalibrationSigma, Camera, Prior, Rig, perturb
from vision.scene import Scene

_CORNERS = np.array([[x, y, z] for x in (0, 1) for y in (0, 1) for z in (0, 1)], float)


def box_scene(boxes: list[tuple[Floats, Floats]]) -> Scene:
    """Boxes, each (lowest corner, size) in mm; every box is an occurrence of its own, edges sampled every 2 mm."""
    vertices: list[Floats] = []
    triangles: list[list[int]] = []
    surface_of: list[int] = []
    normals: list[Floats] = []
    points: list[Floats] = []
    tangents: list[Floats] = []
    normals_a: list[Floats] = []
    normals_b: list[Floats] = []
    arcs: list[Ints] = []
    lengths: list[Floats] = []
    for number, (low, size) in enumerate(boxes):
        for axis in range(3):
            for side in (0, 1):
                corner = _CORNERS[_CORNERS[:, axis] == side]
                normal = np.zeros(3)
                normal[axis] = 2 * side - 1
                base = 4 * len(vertices)
                vertices.append(low + corner * size)
                normals.append(np.tile(normal, (4, 1)))
                way = 1 if (axis == 1) == (side == 1) else -1  # counter-clockwise from outside
                triangles += [[base, base + 1, base + 3][::way], [base, base + 3, base + 2][::way]]
                surface_of += [6 * number + 2 * axis + side] * 2
        for axis in range(3):
            others = [a for a in range(3) if a != axis]
            for u in (0, 1):
                for v in (0, 1):
                    n = int(size[axis] / 2)
                    at = np.tile(low.astype(float), (n, 1))
                    at[:, others] += np.array([u, v]) * size[others]
                    at[:, axis] += (np.arange(n) + 0.5) * size[axis] / n
                    points.append(at)
                    tangents.append(np.tile(np.eye(3)[axis], (n, 1)))
                    normals_a.append(np.tile((2 * u - 1) * np.eye(3)[others[0]], (n, 1)))
                    normals_b.append(np.tile((2 * v - 1) * np.eye(3)[others[1]], (n, 1)))
                    arcs.append(np.full(n, len(arcs)))
                    lengths.append(np.full(n, size[axis] / n))
    return Scene(
        np.concatenate(vertices),
        np.concatenate(normals),
        np.array(triangles),
        np.array(surface_of),
        np.repeat(np.arange(len(boxes)), 6),
        np.concatenate(points),
        np.concatenate(tangents),
        np.concatenate(normals_a),
        np.concatenate(normals_b),
        np.concatenate(arcs),
        np.concatenate(lengths),
        arc_occurrence=np.repeat(np.arange(len(boxes)), 12),
        inspected=np.ones(len(boxes), bool),
        tolerance_mm=np.zeros(len(boxes)),
    )


def block_boxes() -> list[tuple[Floats, Floats]]:
    """A plate with unlike blocks on it: no repetition; the lowest corner and the size of each, mm."""
    boxes = [(np.array([-220.0, -160, -20]), np.array([440.0, 320, 20]))]
    rng = np.random.default_rng(4)
    for x in (-180, -60, 70):
        for y in (-130, -20, 80):
            low = np.array([x, y, 0.0]) + np.append(rng.uniform(0, 25, 2), 0)
            boxes.append((low, rng.uniform([40, 30, 15], [80, 60, 50])))
    return boxes


def blocks(count: int = 9) -> Scene:
    return box_scene(block_boxes()[: 1 + count])


def thinned(scene: Scene, every: int) -> Scene:
    """The scene by one sample of its arcs in so many, which is enough to fit by."""
    some = np.arange(0, len(scene.sample_arc), every)
    return scene.select(some, every * scene.sample_length[some], scene.curved_triangles)


def endless_blocks(pitch: float) -> Scene:
    """A plate with equal blocks at a pitch both ways, wider than any camera here sees."""
    boxes = [(np.array([-1000.0, -1000, -20]), np.array([2000.0, 2000, 20]))]
    for x in np.arange(-4, 5) * pitch:
        boxes += [(np.array([x, y, 0.0]), np.array([60.0, 45, 30])) for y in np.arange(-4, 5) * pitch]
    return box_scene(boxes)


def stereo_rig(size: float = 1.0) -> Rig:
    """Two unlike cameras 120 mm apart, turned in a little, exactly known; of smaller pictures by a factor."""
    right = perturb(np.eye(4), np.array([120.0, 2, -3, 0.004, -0.15, 0.01]))
    lenses = {"left": [[700.0, 0, 322], [0, 700, 238]], "right": [[705.0, 0, 315], [0, 704, 243]]}
    cameras = {n: Camera(int(640 * size), int(480 * size), np.array([*lens, [0, 0, 1 / size]]) * size)
               for n, lens in lenses.items()}  # fmt: skip
    return Rig(cameras, {"left": np.eye(4), "right": right}, dict.fromkeys(cameras, CalibrationSigma()))


def above(x: float, y: float, distance: float) -> Floats:
    """A rig's pose that looks at (x, y, 0) from above, obliquely."""
    turn = perturb(np.diag([1.0, -1, -1, 1]), np.array([0, 0, 0, 0.25, 0.2, 0.1]))
    turn[:3, 3] = np.array([x, y, 0]) - distance * turn[:3, 2]
    return turn


def picture(scene: Scene, camera: Camera, world_from_camera: Floats, seed: int) -> Bytes:
    """The scene by ray casting, each surface one grey."""
    grey = np.random.default_rng(7).uniform(50, 200, len(scene.surface_occurrence))[scene.triangle_surface]
    return cast(scene.rays, grey, (camera.width, camera.height), camera.matrix, world_from_camera, seed)


def off(pose: Floats, sigma_mm: float, sigma_rad: float, seed: int) -> Prior:
    """A prior off by an error drawn from its sigmas."""
    error = np.random.default_rng(seed).normal(0, 1, 6) * np.repeat([sigma_mm, sigma_rad], 3)
    return Prior.isotropic(perturb(pose, error), sigma_mm, sigma_rad)
