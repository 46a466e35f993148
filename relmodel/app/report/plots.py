"""Plots of a run's rows: how sure the pose is, how the residuals lie, what took how long."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from markupsafe import Markup
from sqlalchemy import Connection

from relmodel.app.report.page import PageTable, cell
from relmodel.drawing.plots import ellipse, histogram, residual_map
from relmodel.store import Store

_LONGEST_SHARE = 0.04  # of the picture's width: what the largest residuals are drawn as


def pose_plots(store: Store, connection: Connection, run: int) -> list[Markup]:
    """Error ellipses of the rig's place in the world's planes; nothing where there is no pose."""
    rows = store.rows(connection, "report/pose_matrix", run_id=run)
    if not rows:
        return []
    covariance = np.reshape(rows[0].covariance_world, (6, 6))
    planes = [
        ellipse(covariance[np.ix_(pair, pair)], words)
        for pair, words in (((0, 1), "x, y"), ((0, 2), "x, z"), ((1, 2), "y, z"))
    ]
    return [_figure("Where the rig may stand about the pose found, in the world's axes: one and two sigma", planes)]


def evidence_plots(store: Store, connection: Connection, run: int) -> list[Markup]:
    """Of each camera the residuals of the edge points over their sigma, and where they lie in the picture."""
    rows = store.columns(connection, "report/measurements", run_id=run)
    if not len(rows["u"]):
        return []
    camera = np.asarray(rows["camera"])
    u, v, nu, nv, sigma, weight, residual = (
        np.asarray(rows[c], float) for c in ("u", "v", "normal_u", "normal_v", "sigma", "weight", "residual")
    )
    out = []
    for row in store.rows(connection, "report/rig_cameras", run_id=run):
        own = camera == row.camera
        if not own.any():
            continue
        kept = own & (weight > 0.01)
        longest = max(float(np.quantile(np.abs(residual[kept]), 0.95)) if kept.any() else 1.0, 1e-3)
        scale = float(f"{_LONGEST_SHARE * row.width / longest:.1g}")
        lie = residual_map(
            np.stack([u, v], axis=1)[own], np.stack([nu, nv], axis=1)[own], residual[own], row.width, row.height, scale
        )
        words = f"{row.camera}: residuals of edge points over their sigma, with the normal distribution; "
        out.append(
            _figure(
                words + f"and in the picture, {scale:g} times as long",
                [histogram(residual[own] / sigma[own], weight[own]), lie],
            )
        )
    return out


def times(steps: PageTable) -> PageTable:
    """The table of steps with a bar for how long each took."""
    seconds = [r[list(steps.columns).index("seconds")] for r in steps.rows]
    longest = max(
        (s for r, s in zip(steps.rows, seconds, strict=True) if s is not None and r[0] == "step"), default=None
    )
    if not longest:
        return steps
    bars = [
        Markup(
            '<svg class="time" viewBox="0 0 100 6" width="160" height="10" aria-hidden="true">'
            '<rect width="{:.1f}" height="6"/></svg>'
        ).format(100 * s / longest)
        if s is not None and r[0] == "step"
        else ""
        for r, s in zip(steps.rows, seconds, strict=True)
    ]
    rows = [(*r, bar) for r, bar in zip(steps.rows, bars, strict=True)]
    return replace(steps, columns=[*steps.columns, ""], rows=rows)


def _figure(words: str, drawings: Sequence[Any]) -> Markup:
    drawn = Markup("").join(drawings)
    return Markup('<figure class="drawn"><div class="flow">{}</div><figcaption>{}</figcaption></figure>').format(
        drawn, cell(words)
    )
