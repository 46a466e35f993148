"""What the store holds of a model, derived: shared shapes, numbers snapped to the store's, keys, features, boxes.

All of it is made before anything is written; the model stays as it is.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial
from typing import TypeVar

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Floats
from relmodel.features import Feature, feature_class_key, recognise
from relmodel.geometry.curves import boxes_of
from relmodel.geometry.hulls import outermost
from relmodel.loading.snap.snap import snap
from relmodel.loading.stored_keys import stored_ids
from relmodel.model.content_keys import ModelKeys, model_keys
from relmodel.model.model import Finding, Model, Shape
from relmodel.model.sharing import share
from relmodel.store.database import Database

Made = TypeVar("Made")


@dataclass(frozen=True)
class DerivedShape:
    """What is derived from a shape, as columns of the tables without the shape's identity.

    class_keys: keys of the features' classes.  box: x0 y0 z0 x1 y1 z1, mm; area: of all surfaces, mm2.
    hull: corners (n, 3) of the convex hull of its triangles; None where it has none, or fills its box.
    """

    features: tuple[Feature, ...]
    class_keys: tuple[str, ...]
    box: Floats
    area: float
    hull: Floats | None = None


@dataclass(frozen=True)
class Noted:
    """A finding, and which part and shape of the model it is of; None where it is of none."""

    finding: Finding
    part: int | None = None
    shape: int | None = None


@dataclass(frozen=True)
class Derived:
    """A model ready to be written.

    shapes: by number of the shape, of those that the store lacks (the first of equal ones).  findings: of the model and
    of the derivation.
    """

    model: Model
    keys: ModelKeys
    shapes: dict[int, DerivedShape]
    findings: tuple[Noted, ...]


def derive(
    model: Model, store: Database, connection: Connection, tell: Callable[[str], None] = lambda _: None
) -> Derived:
    """Derive from a model what the store will hold; the store is read and not written.

    tell: is told what is being done.  Raises InputError where an assembly contains itself.
    """
    model = share(model)
    keys = model_keys(model)
    snapped = snap(store, connection, model, keys)
    if snapped is not model:
        model, keys = snapped, model_keys(snapped)
    failures: list[Noted] = []
    shapes = {}
    first = {k.shape: i for i, k in reversed(list(enumerate(keys.shapes)))}  # of equal ones
    known = stored_ids(store, connection, "shape", first)
    new = sorted(i for key, i in first.items() if key not in known)
    for count, no in enumerate(new, 1):
        tell(f"recognising features, shape {count} of {len(new)}")
        shapes[no] = _derived_shape(model.shapes[no], no, failures)
    part_of = {part.shape: i for i, part in reversed(list(enumerate(model.parts)))}
    found = [replace(n, part=part_of.get(n.shape)) if n.shape is not None else n for n in failures]
    return Derived(model, keys, shapes, (*_noted(model), *found))


def _noted(model: Model) -> list[Noted]:
    """Findings of the readers: of the file, then by part, then by shape with the first part that has it."""
    part_of = {part.shape: i for i, part in reversed(list(enumerate(model.parts)))}
    return [
        *(Noted(finding) for finding in model.findings),
        *(Noted(finding, i, part.shape) for i, part in enumerate(model.parts) for finding in part.findings),
        *(Noted(finding, part_of.get(i), i) for i, shape in enumerate(model.shapes) for finding in shape.findings),
    ]


def _attempt(what: str, make: Callable[[], Made], failures: list[Noted], shape: int | None = None) -> Made | None:
    """The result of `make`; None where it fails, which is a finding and never costs a load."""
    try:
        return make()
    except Exception as error:
        said = f"{what} could not be recognised ({type(error).__name__}: {error})"
        failures.append(Noted(Finding(f"{what.replace(' ', '_')}_failed", said), shape=shape))
        return None


def _derived_shape(shape: Shape, no: int, failures: list[Noted]) -> DerivedShape:
    features = tuple(_attempt("features", partial(recognise, shape), failures, no) or ())
    every = np.concatenate([boxes_of(shape.surfaces), boxes_of(shape.arcs)])
    box = np.concatenate([every[:, :3].min(axis=0), every[:, 3:].max(axis=0)])
    return DerivedShape(
        features=features,
        class_keys=tuple(map(feature_class_key, features)),
        box=box,
        area=float(np.sum(np.asarray(shape.surfaces["area"], float))) if shape.surfaces else 0.0,
        hull=_hull(shape, box),
    )


def _hull(shape: Shape, box: Floats) -> Floats | None:
    meshed = len(np.unique(np.asarray(shape.mesh.triangle_surfaces)))
    if meshed == 0 or meshed < len(shape.surfaces["area"]):
        return None
    points = np.asarray(shape.samples.points.values, float).reshape(-1, 3)  # a fitted arc may pass beyond a mesh
    vertices = np.asarray(shape.mesh.vertices, float).reshape(-1, 3)
    used = np.zeros(len(vertices), bool)
    used[np.asarray(shape.mesh.triangles)] = True
    hull = np.unique(outermost(np.concatenate([vertices[used], points])), axis=0)
    at_corner = ((hull == box[:3]) | (hull == box[3:])).all(axis=1)
    return None if len(np.unique(hull[at_corner], axis=0)) == 8 else hull
