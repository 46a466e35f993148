"""Why an inspection decided as it did: sentences that follow from its rows.

Each subject is a folder of `queries/why`.  Its queries run in the order of their names, and each row is a sentence.
What runs record in future is explained by one more query.
"""

from __future__ import annotations

from typing import NamedTuple

from sqlalchemy import Connection

from relmodel.app.audit.newest import find_run
from relmodel.errors import UsageError
from relmodel.store import Store, sql
from relmodel.text import nearest_name


class Sentence(NamedTuple):
    """A sentence from a query of a subject; topic: the query's name, as `rules` or `correspondence`."""

    topic: str
    sentence: str


def explain(
    store: Store, run: int, *, pose: bool = False, arc: str | None = None, feature: str | None = None
) -> list[Sentence]:
    """What is said of an image arc (CAMERA:NUMBER), of a part or feature by its path, of the pose, else of the verdict.

    Raises UsageError where it is not there."""
    if arc is not None:
        camera, _, number = arc.rpartition(":")
        if not camera or not number.isdigit():
            raise UsageError(
                f"the arc {arc} is not CAMERA:NUMBER: give the camera's name and the arc's number, as left:17"
            )
        return explain_arc(store, run, camera, int(number))
    if feature is not None:
        return explain_feature(store, run, feature)
    return (explain_pose if pose else explain_verdict)(store, run)


def explain_verdict(store: Store, run: int) -> list[Sentence]:
    """Why a run has its verdict: its rules, and the poses that were considered.  Raises UsageError for other runs than
    inspections that came to a verdict."""
    return _explain(store, run, "verdict")


def explain_pose(store: Store, run: int) -> list[Sentence]:
    """What the pose of a run rests on."""
    return _explain(store, run, "pose")


def explain_arc(store: Store, run: int, camera: str, arc: int) -> list[Sentence]:
    """What became of an image arc.  Raises UsageError where the run has no such camera or arc."""
    return _explain(store, run, "arc", camera=camera, arc=arc)


def explain_feature(store: Store, run: int, path: str) -> list[Sentence]:
    """What is said of a part or feature.  Raises UsageError where the run's world has none of that path in view."""
    return _explain(store, run, "feature", path=path)


def _explain(store: Store, run: int, subject: str, camera: str = "", arc: int = -1, path: str = "") -> list[Sentence]:
    asked = {"run": run, "camera": camera, "arc": arc, "path": path}
    with store.read() as connection:
        _check_run(store, connection, run)
        said = [
            Sentence(name.rpartition("/")[2].partition("_")[2], str(row.sentence))
            for name in sql.query_names(f"why/{subject}")
            for row in connection.execute(sql.query(name), asked)
        ]
        if not said:
            raise UsageError(_nothing(store, connection, run, camera, arc, path))
    return said


def _check_run(store: Store, connection: Connection, run: int) -> None:
    it = find_run(store, connection, run)
    if it.kind != "inspect":
        raise UsageError(f"run {run} is of kind {it.kind}: name one of kind inspect, as relmodel runs lists them")
    pruned = store.rows(connection, "audit/pruned", run=run)
    if pruned:
        raise UsageError(f"what run {run} found was pruned by run {pruned[0].by_run_id}")
    if it.verdict is None:
        raise UsageError(f"run {run} came to no verdict, it is {it.state}{f': {it.message}' if it.message else ''}")


def _nothing(store: Store, connection: Connection, run: int, camera: str, arc: int, path: str) -> str:
    if camera:
        cameras = {row.camera: int(row.arcs) for row in store.rows(connection, "audit/cameras", run=run)}
        if camera not in cameras:
            return f"run {run} has no camera {camera}: name one of {', '.join(cameras)}"
        return f"the {camera} picture of run {run} has no arc {arc}: it has arcs 0 to {cameras[camera] - 1}"
    paths = store.select(connection, "part_in_view", "path", order="in_view_no", run_id=run)["path"].tolist()
    near = nearest_name(path, paths)
    hint = f"did you mean {near}?" if near else "the view part_in_view lists what is"
    return f"run {run} has no {path} in view: {hint}"
