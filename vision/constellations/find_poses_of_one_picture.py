"""Poses of a rig from one picture, with a prior or without: the join of its ellipses with the model's circles, a fit of
each joined pair, and how many ellipses a pose explains."""

from __future__ import annotations

import numpy as np
from sqlalchemy import Connection

from relmodel.columns import Columns
from relmodel.features.circle_relations import DEFAULTS as KEPT
from relmodel.geometry.transforms import matrices
from relmodel.store.database import Database
from vision.cameras.cameras import Camera, Prior, Rig
from vision.constellations.circles import Circles, read_circles
from vision.constellations.circles_of_ellipses import PictureEllipses, find_circles, find_ellipses
from vision.constellations.constellation_parameters import (
    DEFAULTS,
    ConstellationParameters,
    OnePictureParameters,
)
from vision.constellations.ellipse_fit import EllipseFit, to_matrices, to_rows
from vision.constellations.find_poses import Found, are_near, best_distinct, candidates
from vision.constellations.join import JoinedPairs, solve_poses
from vision.extraction.primitives import Primitives


def find_poses_of_one_picture(
    store: Database,
    connection: Connection,
    rig: Rig,
    world_id: int,
    picture: Primitives,
    prior: Prior | None = None,
    p: ConstellationParameters = DEFAULTS,
) -> Found:
    """Distinct poses of a rig of one camera at which ellipses of its picture are circles of the inspected objects.

    An ellipse and a radius of an object are a circle in space, and two such circles that lie to each other as two of
    the object give a pose, which is fitted to both ellipses.  Every pose is scored on all ellipses: the log odds of
    finding those that it explains against finding them by chance.  The best are fitted to all that they explain, and
    scored again.  The poses are perturbations of the prior, where none is given of an open one at the best; those far
    from a prior are dropped.  A picture with too few ellipses, or an object with too few circles, gives no pose."""
    ((name, camera),) = rig.cameras.items()
    camera_from_rig = np.linalg.inv(rig.rig_from_camera[name])
    ellipses = find_ellipses(picture, camera, p.ellipses)
    seen, unit = _see(ellipses, camera)
    objects = store.columns(connection, "constellations/objects", world_id=world_id)
    joins = [
        (read_circles(store, connection, number), join_ellipses(store, connection, number, seen, p.one_picture))
        for number in objects["object_id"].tolist()
    ]
    placed = [_place(unit, model, joined) for model, joined in joins]
    if not sum(len(scene) for scene, _ in placed):
        return Found(*candidates("join", np.zeros((0, 4, 4)), np.zeros(0), prior, p.one_picture.enough), {})
    middle = np.median(np.concatenate([scene.centre for scene, _ in placed]), axis=0)
    poses, scores = [], []
    for world_from_object, (model, joined), where in zip(matrices(objects), joins, placed, strict=True):
        solved = solve_poses(where[0], model, where[1]).reshape(-1, 4, 4)
        fit = EllipseFit(ellipses, camera, model, p.one_picture)
        circle, ellipse = (np.repeat(pair, 2, axis=0) for pair in (joined.model, joined.scene // 2))
        rows = fit.fit_pairs(to_rows(solved), circle, ellipse)
        if prior is not None:
            rows = rows[are_near(world_from_object @ to_matrices(rows) @ camera_from_rig, prior, p.poses)]
        score, which = fit.score(rows)
        best = best_distinct(to_matrices(rows), score, middle, p.poses, p.one_picture.fitted)
        rows = fit.fit(rows[best], *fit.explained(which[best]))[0]
        poses.append(world_from_object @ to_matrices(rows) @ camera_from_rig)
        scores.append(fit.score(rows)[0])
    pose, score = np.concatenate(poses), np.concatenate(scores)
    in_rig = rig.rig_from_camera[name] @ np.append(middle, 1.0)
    kept = best_distinct(pose, score, in_rig[:3], p.poses, p.one_picture.kept)
    return Found(*candidates("join", pose[kept], score[kept], prior, p.one_picture.enough), {})


def join_ellipses(
    store: Database, connection: Connection, object_id: int, seen: Columns, p: OnePictureParameters
) -> JoinedPairs:
    """Join the circles that ellipses may be with those of an object: `queries/constellations/one_picture.sql`, whose
    relation `seen_circle` is given; the scene's circles are its units."""
    names = (
        "radius_step", "distance_mm", "distance_share", "most_mm", "turn", "along", "most_of_relation", "most",
    )  # fmt: skip
    with store.relation(connection, "seen_circle", seen):
        joined = store.columns(
            connection,
            "constellations/one_picture",
            object_id=object_id,
            least_distance=KEPT.least_distance,
            greatest_distance=KEPT.greatest_distance,
            **{name: getattr(p, name) for name in names},
        )
    units, circles = (np.stack([joined[f"{n}_a"], joined[f"{n}_b"]], axis=1) for n in ("unit", "circle"))
    return JoinedPairs(units.astype(np.int64), circles.astype(np.int64), joined["alike"].astype(np.int64))


def _see(ellipses: PictureEllipses, camera: Camera) -> tuple[Columns, Circles]:
    """The two circles of radius 1 of each ellipse: columns of the relation `seen_circle`, and as circles."""
    centre, normal = (vectors.reshape(-1, 3) for vectors in find_circles(ellipses, camera))
    number = np.arange(len(centre))
    columns: Columns = {
        "unit": number,
        "ellipse_no": number // 2,
        **dict(zip("xyz", centre.T, strict=True)),
        **dict(zip(("nx", "ny", "nz"), normal.T, strict=True)),
        "size_share": np.repeat(ellipses.size_share, 2),
        "tilt": np.repeat(ellipses.tilt, 2),
    }
    return columns, Circles.exact(centre, normal, np.ones(len(centre)))


def _place(unit: Circles, model: Circles, joined: JoinedPairs) -> tuple[Circles, JoinedPairs]:
    """The circles of the scene that joined pairs name, of the model's radii, and the pairs by rows of them."""
    row, circle = joined.scene.ravel(), joined.model.ravel()
    radius = model.radius[circle]
    placed = Circles.exact(unit.centre[row] * radius[:, None], unit.normal[row], radius)
    return placed, JoinedPairs(np.arange(len(row)).reshape(-1, 2), joined.model, joined.alike)
