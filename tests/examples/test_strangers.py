"""Strangers by the CAD kernel's own measures: parts are valid solids, and a change is where and what it says."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np
import pytest

pytest.importorskip("OCP")


from examples.render.families import FAMILIES, body, can_make, changes, draw
from examples.render.strangers import components_of, edge_px, move_px, sharp_edges, stretch
from examples.render.truth import Caster
from tests.examples.test_trials import from_above


def volume(shape: Any) -> float:
    from OCP.BRepGProp import BRepGProp
    from OCP.GProp import GProp_GProps

    found = GProp_GProps()
    BRepGProp.VolumeProperties_s(shape, found)
    return float(found.Mass())


def bounds(shape: Any) -> Any:
    from OCP.Bnd import Bnd_Box
    from OCP.BRepBndLib import BRepBndLib

    box = Bnd_Box()
    BRepBndLib.AddOptimal_s(shape, box, False, False)
    return np.array([[c.X(), c.Y(), c.Z()] for c in (box.CornerMin(), box.CornerMax())])


def test_what_the_kernel_cannot_round_is_not_made() -> None:
    assert [can_make(replace(draw("casting", 5), fillet=fillet)) for fillet in (2.0, 40.0)] == [True, False]


@pytest.mark.parametrize(("family", "kind"), list(zip(FAMILIES, 2 * ["missing", "resized", "offset"], strict=True)))
def test_a_change_is_where_and_what_it_says(family: str, kind: str) -> None:
    from OCP.BRepAlgoAPI import BRepAlgoAPI_Cut

    design = replace(draw(family, 5), fillet=0.0)  # the kernel takes long to tell rounded solids apart
    made = [found for found in changes(design, kind, np.random.default_rng(3)) if not found[0].name.startswith("BOLT")]
    change, changed = made[-1]
    before, after = body(design), body(changed)
    cut = next(piece.cut for piece in design.pieces if piece.name == change.name)
    more = volume(after) - volume(before)
    assert (more > 0) == {"missing": cut, "resized": (change.amount > 0) != cut, "offset": True}[kind]
    boxes = np.array([change.before, change.after or change.before])
    left = [BRepAlgoAPI_Cut(one, two).Shape() for one, two in ((before, after), (after, before))]
    differing = [shape for shape in left if volume(shape) > 1e-3]
    assert sum(volume(shape) for shape in differing) == pytest.approx(abs(more), rel=0.02)
    for shape in differing:
        box = bounds(shape)
        assert (box[0] > boxes.min(axis=(0, 1)) - 0.01).all()
        assert (box[1] < boxes.max(axis=(0, 1)) + 0.01).all()


def test_edges_of_a_cylinder_and_of_a_block_from_above() -> None:
    design = draw("turned", 5)
    flange = replace(design, pieces=(replace(design.pieces[0], round=("z", 0.0)),))  # a disk
    components = components_of(flange)
    edges, view = sharp_edges(components), from_above(400.0)
    (_, _, top), radius = flange.pieces[0].high, flange.pieces[0].high[0]
    assert np.linalg.norm(edges[1] - edges[0], axis=1).sum() == pytest.approx(4 * np.pi * radius, rel=0.01)
    seen = edge_px(edges, ((-99, -99, top - 1), (99, 99, top + 1)), Caster(components), view)["left"]
    assert seen == pytest.approx(2 * np.pi * radius * 400 / (400 - top), rel=0.01)


def test_what_the_pose_takes_up_does_not_count_as_moved() -> None:
    components = components_of(draw("plate", 5))
    edges, caster, view = sharp_edges(components), Caster(components), from_above(400.0)
    alike, across = (move_px(edges, np.array(f), caster, view) for f in ([1.05, 1.05, 1.05], [1.05, 1, 1]))
    assert alike < 0.6 < 2 < across
    longer = np.concatenate(Caster(stretch(components, np.array([1.05, 1, 1]))).vertices)
    points = np.concatenate(caster.vertices)
    np.testing.assert_allclose(np.ptp(longer, axis=0), np.ptp(points, axis=0) * [1.05, 1, 1])
