"""Content and support keys: what changes them and what does not."""

from __future__ import annotations

from copy import deepcopy
from dataclasses import replace

import numpy as np
import pytest
import trimesh

from relmodel.errors import InputError
from relmodel.model.content_keys import model_keys, quantised, shape_keys
from relmodel.model.model import Assembly, Instance, Model, Shape
from relmodel.readers.mesh.shape import shape_from_triangles


def box(extents: tuple[float, float, float] = (30.0, 20.0, 10.0)) -> Shape:
    mesh = trimesh.creation.box(bounds=[np.zeros(3), np.array(extents)])
    shape = shape_from_triangles(np.asarray(mesh.vertices, float), np.asarray(mesh.faces, np.int64))
    assert shape is not None
    return shape


def jittered(shape: Shape, size: float) -> Shape:
    shape = deepcopy(shape)
    rng = np.random.default_rng(1)
    for table in (shape.surfaces, shape.arcs):
        for name, values in table.items():
            if isinstance(values, np.ndarray) and values.dtype.kind == "f":
                table[name] = values + rng.normal(0, size, len(values))
    return shape


def test_round_off_does_not_show() -> None:
    shape = box((76.2, 25.4 / 128, 12.345678))
    assert shape_keys(jittered(shape, 1e-12)) == shape_keys(shape)


def test_nominal_dimensions_lie_inside_their_cells() -> None:
    inches = 25.4 * np.arange(-2000, 2000) / 128
    millimetres = np.arange(-2000, 2000) / 2000
    for values in (inches, millimetres):
        for noise in (-1e-10, 1e-10):
            assert np.array_equal(quantised(values, 1e-6), quantised(values + noise, 1e-6))


def test_a_moved_side_changes_what_it_touches() -> None:
    low, high = shape_keys(box()), shape_keys(box((30.0, 20.0, 11.0)))
    assert low.shape != high.shape
    # The bottom stays; of twelve edges the four around it stay; five planes of six carry on.
    assert len(set(low.surfaces) & set(high.surfaces)) == 1
    assert len(set(low.arcs) & set(high.arcs)) == 4
    assert len(set(low.surface_supports) & set(high.surface_supports)) == 5


def test_loops_may_begin_anywhere_and_faces_come_in_any_order() -> None:
    shape = box()
    turned = replace(shape, coedges={name: np.roll(values, 1) for name, values in shape.coedges.items()})
    assert shape_keys(turned).surfaces == shape_keys(shape).surfaces
    backward = replace(shape, coedges=shape.coedges | {"reversed": ~np.asarray(shape.coedges["reversed"])})
    assert not set(shape_keys(backward).surfaces) & set(shape_keys(shape).surfaces)


@pytest.mark.parametrize(
    ("kind", "radius", "semi_angle", "same"),
    [
        ("plane", np.nan, np.nan, {"origin": (4, -9, 5), "axis_z": (0, 0, -1)}),
        ("cylinder", 3.0, np.nan, {"origin": (1, 2, -7), "axis_z": (0, 0, -1)}),
        # Two millimetres up the axis the cone is wider by 2 tan 30 degrees.
        ("cone", 3.0, np.pi / 6, {"origin": (1, 2, 7), "radius": 3 + 2 * np.tan(np.pi / 6)}),
        # The same cone described from above: axis and angle change sign.
        ("cone", 3.0, np.pi / 6, {"axis_z": (0, 0, -1), "semi_angle": -np.pi / 6}),
        ("sphere", 3.0, np.nan, {"axis_z": (1, 0, 0)}),
        ("torus", 3.0, np.nan, {"axis_z": (0, 0, -1)}),
    ],
)
def test_support_is_independent_of_how_it_is_described(
    kind: str, radius: float, semi_angle: float, same: dict[str, tuple[float, float, float] | float]
) -> None:
    def support(changes: dict[str, tuple[float, float, float] | float]) -> str:
        shape = box()
        values: dict[str, tuple[float, float, float] | float]
        values = {
            "origin": (1, 2, 5),
            "axis_z": (0, 0, 1),
            "radius": radius,
            "radius2": 1.0 if kind == "torus" else np.nan,
            "semi_angle": semi_angle,
        }
        values.update(changes)
        for name, value in values.items():
            if isinstance(value, tuple):
                for c, v in zip("xyz", value, strict=True):
                    shape.surfaces[f"{name}_{c}"][0] = v
            else:
                shape.surfaces[name][0] = value
        shape.surfaces["kind"] = shape.surfaces["recognised_kind"] = np.array([kind] + ["plane"] * 5)
        return shape_keys(shape).surface_supports[0]

    assert support(same) == support({})
    assert support({"origin": (1, 2.5, 5.001)}) != support({})


def test_an_assembly_within_itself_is_refused() -> None:
    loop = (
        Assembly("a", (Instance("b:1", "assembly", 1, np.eye(4)),)),
        Assembly("b", (Instance("a:1", "assembly", 0, np.eye(4)),)),
    )
    model = Model("step", "mm", 1.0, (), (), loop, 0, 0, "1")
    with pytest.raises(InputError, match="contains itself"):
        model_keys(model)
