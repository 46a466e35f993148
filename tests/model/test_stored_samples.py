"""Samples along arcs come out of the store's columns as they went in, and what follows from the ends is not kept."""

from __future__ import annotations

import numpy as np
import pytest

from relmodel.arrays import Ragged
from relmodel.model.measures import pack_samples, spread_samples
from relmodel.model.model import ArcSamples

WIDTH = {"points": 3, "tangents": 3, "normals_a": 3, "normals_b": 3}


def test_samples_come_out_as_they_went_in() -> None:
    """A straight arc at even places, one at uneven ones, a half circle, and an arc of two points."""
    even, uneven = np.linspace(3, 57, 55), np.linspace(0, 6, 7) ** 2
    turn = np.linspace(0, np.pi, 31)
    up, pair = np.array([0.0, 0.0, 1.0]), np.array([0.0, 1.0])
    lean = np.stack([0.6 * np.cos(turn), 0.6 * np.sin(turn), np.full(31, 0.8)], axis=1)
    line = np.array([0.36, 0.48, 0.8])
    circle = 20 * np.stack([np.cos(turn), np.sin(turn), 0 * turn], axis=1) + [1000.1, 0, 0]
    along = np.stack([-np.sin(turn), np.cos(turn), 0 * turn], axis=1)
    given: dict[str, list[np.ndarray]] = {
        "points": [even[:, None] * line + 1234.5, uneven[:, None] * line, circle, pair[:, None] * line],
        "tangents": [np.tile(line, (55, 1)), np.tile(line, (7, 1)), along, np.tile(line, (2, 1))],
        "normals_a": [np.tile(up, (55, 1)), np.tile(up, (7, 1)), lean, np.tile(up, (2, 1))],
        "normals_b": [np.tile(up, (55, 1)), np.tile(up, (7, 1)), np.tile(up, (31, 1)), np.array([up, -up])],
    }
    columns = {name: Ragged.pack(rows, np.float64 if name == "points" else np.float32) for name, rows in given.items()}
    kept = pack_samples(ArcSamples(arc_no=np.arange(4), **columns))
    count = np.asarray(kept["sample_count"])
    assert count.tolist() == [55, 7, 31, 2]
    lengths = {name: np.diff(kept[name].offsets) // width for name, width in WIDTH.items()}
    assert {name: length.tolist() for name, length in lengths.items()} == {
        "points": [2, 7, 31, 2],
        "tangents": [1, 1, 31, 1],
        "normals_a": [1, 1, 31, 1],
        "normals_b": [1, 1, 1, 2],
    }
    for name, width in WIDTH.items():
        spread = spread_samples([kept[name][row] for row in range(4)], count, width)
        went_in = columns[name].values.reshape(-1, width)
        assert spread == pytest.approx(went_in, rel=0, abs=1e-12)
        ends = np.append(np.cumsum(count) - count, np.cumsum(count) - 1)
        assert (spread[ends] == went_in[ends]).all()
