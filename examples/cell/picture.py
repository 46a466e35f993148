"""A picture of a world: rays cast at the stored triangles, lit from two sides, outlines where parts meet."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import numpy.typing as npt

from relmodel.find.find import world_named
from relmodel.geometry.transforms import apply, matrices
from relmodel.store import Store

Array = npt.NDArray[np.float64]

SIZE = (1600, 900)  # pixels
SAMPLES = 2  # a pixel, each way
FIELD_DEG = 36.0  # across
EYE, TARGET = np.array([-6100.0, -4300.0, 4300.0]), np.array([-50.0, 0.0, 620.0])
LIGHTS = ((np.array([-0.35, -0.75, 0.55]), 0.62), (np.array([0.8, -0.2, 0.55]), 0.28))
AMBIENT = 0.28
FLOOR, SKY, PLAIN = "#d5d6d4", "#f2f4f6", "#a9b0b8"


def draw_cell(target: str, picture: Path) -> None:
    """Draw the world of a store."""
    import cv2

    vertices, triangles, owner, colours = _triangles(target)
    hit, normal, directions = _cast(vertices, triangles)
    linear = np.full((len(hit), 3), 0.0)
    seen = hit >= 0
    linear[seen] = colours[owner[hit[seen]]]
    facing = np.where(np.sum(normal * directions, axis=1, keepdims=True) > 0, -normal, normal)
    light = AMBIENT + sum(strength * np.clip(facing @ (way / np.linalg.norm(way)), 0, 1) for way, strength in LIGHTS)
    linear[seen] *= light[seen, None]
    ground = ~seen & (directions[:, 2] < 0)
    spot = EYE + directions * (-EYE[2] / np.where(ground, directions[:, 2], -1.0))[:, None]
    fade = np.clip(np.linalg.norm(spot[:, :2], axis=1) / 16000, 0, 1)[:, None]
    shade = _shadow(vertices, triangles, spot, ground)
    background = np.where(ground[:, None], (1 - fade) * _rgb(FLOOR) * shade[:, None] + fade * _rgb(SKY), _rgb(SKY))
    linear = np.where(seen[:, None], linear, background)

    width, height = SIZE[0] * SAMPLES, SIZE[1] * SAMPLES
    part = np.where(seen, owner[hit], -1).reshape(height, width)
    turned = np.where(seen[:, None], normal, 0).reshape(height, width, 3)
    edge = np.zeros((height, width), bool)
    for axis in (0, 1):
        step = np.roll(part, 1, axis) != part
        step |= np.sum(np.roll(turned, 1, axis) * turned, axis=2) < np.where(part >= 0, 0.75, -1)
        edge |= step & ((part >= 0) | (np.roll(part, 1, axis) >= 0))
    edge[0], edge[:, 0] = False, False  # what rolled around
    image = linear.reshape(height, width, 3) * np.where(edge, 0.45, 1.0)[:, :, None]
    image = cv2.resize(np.clip(image, 0, 1).astype(np.float32), SIZE, interpolation=cv2.INTER_AREA)
    shown = np.round(255 * image[:, :, ::-1] ** (1 / 2.2)).astype(np.uint8)
    cv2.imwrite(str(picture), shown)


def _triangles(target: str) -> tuple[Array, npt.NDArray[np.int64], npt.NDArray[np.int64], Array]:
    """Vertices and triangles of all placed parts in the world, the part of each triangle, and linear colours."""
    with Store.open(target, read_only=True) as store, store.read() as connection:
        world_id, _ = world_named(store, connection, None)
        parts = store.columns(connection, "scene/coloured_parts", world_id=world_id, run_id=None)
        shapes = np.unique(parts["shape_id"]).tolist()
        meshes = store.columns(connection, "scene/meshes", shape_ids=shapes)
    of_shape = {int(s): i for i, s in enumerate(meshes["shape_id"])}
    vertices, triangles, owner, start = [], [], [], 0
    for number, world_from_part in enumerate(matrices(parts)):
        i = of_shape[int(parts["shape_id"][number])]
        placed = apply(world_from_part, np.asarray(meshes["vertices"][i], float).reshape(-1, 3))
        corners = np.asarray(meshes["triangles"][i], np.int64).reshape(-1, 3)
        vertices.append(placed)
        triangles.append(corners + start)
        owner.append(np.full(len(corners), number))
        start += len(placed)
    colours = np.array([_rgb(colour or PLAIN) for colour in parts["colour"]])
    return np.concatenate(vertices), np.concatenate(triangles), np.concatenate(owner), colours


def _cast(vertices: Array, triangles: npt.NDArray[np.int64]) -> tuple[npt.NDArray[np.int64], Array, Array]:
    """First triangle that the ray of each sample meets (-1: none), that triangle's normal, and the rays."""
    forward = (TARGET - EYE) / np.linalg.norm(TARGET - EYE)
    right = np.cross(forward, [0, 0, 1.0])
    right /= np.linalg.norm(right)
    down = np.cross(forward, right)
    width, height = SIZE[0] * SAMPLES, SIZE[1] * SAMPLES
    reach = np.tan(np.radians(FIELD_DEG) / 2) / (width / 2)
    x, y = np.meshgrid((np.arange(width) + 0.5 - width / 2) * reach, (np.arange(height) + 0.5 - height / 2) * reach)
    directions = forward + x.reshape(-1, 1) * right + y.reshape(-1, 1) * down
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    hit = _rays(vertices, triangles, np.broadcast_to(EYE, directions.shape), directions)
    corner = vertices[triangles]
    normals = np.cross(corner[:, 1] - corner[:, 0], corner[:, 2] - corner[:, 0])
    normals /= np.maximum(np.linalg.norm(normals, axis=1, keepdims=True), 1e-300)
    return hit, normals[hit], directions


def _shadow(vertices: Array, triangles: npt.NDArray[np.int64], spot: Array, ground: npt.NDArray[np.bool_]) -> Array:
    """How much of the first light reaches points of the floor."""
    out = np.ones(len(spot))
    rows = np.flatnonzero(ground)
    way = LIGHTS[0][0] / np.linalg.norm(LIGHTS[0][0])
    hit = _rays(vertices, triangles, spot[rows] + [0, 0, 0.5], np.broadcast_to(way, (len(rows), 3)))
    out[rows[hit >= 0]] = 0.62
    return out


def _rays(vertices: Array, faces: npt.NDArray[np.int64], origins: Array, directions: Array) -> npt.NDArray[np.int64]:
    """First triangle that each ray meets (n,), -1 for none."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    scene = EmbreeScene()
    TriangleMesh(scene, vertices[faces].astype(np.float32))
    found = scene.run(np.ascontiguousarray(origins, np.float32), np.ascontiguousarray(directions, np.float32))
    return np.asarray(found, np.int64)


def _rgb(colour: str) -> Array:
    """Linear light of #rrggbb."""
    return (np.array([int(colour[i : i + 2], 16) for i in (1, 3, 5)]) / 255) ** 2.2
