"""A store opened by `relmodel.open`: the Python interface over the modules that do the work."""

from __future__ import annotations

from collections.abc import Callable
from functools import cached_property, wraps
from html import escape
from pathlib import Path
from typing import TYPE_CHECKING, Any, ParamSpec, Unpack

import numpy.typing as npt

from relmodel.find import find
from relmodel.find.volumes import Volume
from relmodel.names import visible
from relmodel.store import Store, sql
from relmodel.store.ask import TIME_LIMIT_S, ask_arrow
from relmodel.table import Contents, Table, table_of
from relmodel.variants.compare import REACH

if TYPE_CHECKING:
    from relmodel.app.attributes import AttributeOwner
    from relmodel.app.report.write import Subject
    from relmodel.app.session import Options, Session
    from relmodel.loading.write import LoadReport
    from relmodel.world.kinematics import Carrier
    from relmodel.world.placement import WorldReport
    from vision.cameras.images import Pictures
    from vision.inspection.answer import Inspection
    from vision.planning import Plan, PlanOptions
    from vision.scene import Scenes


P = ParamSpec("P")


def _as_contents(search: Callable[P, dict[str, npt.NDArray[Any]]]) -> Callable[P, Contents]:
    """A search of a store, by columns that a notebook shows."""

    @wraps(search)
    def found(*args: P.args, **kwargs: P.kwargs) -> Contents:
        return Contents(search(*args, **kwargs))

    return found


class OpenStore(Store):
    """A store to query, and to fill where it is open for writing; a context manager that closes it.

    Lengths are mm and angles rad; transforms `a_from_b` are 4x4 arrays.  What is wrong is raised as InputError (a file
    or number), UsageError (the call) or StoreError (the store), each one sentence."""

    def load(
        self, path: str | Path, *, name: str, variant: str = "", unit: str | None = None, occluder: bool = False
    ) -> LoadReport:
        """Load a STEP, mesh or URDF file under a name and a variant: `relmodel.loading.load.load`.

        unit: the length unit of a file that states none.  occluder: keep a mesh as triangles, not inspected."""
        from relmodel.loading.load import load

        return load(self, path, name=name, variant=variant, unit=unit, occluder=occluder)

    def place(self, path: str | Path) -> WorldReport:
        """Place the world of a world file, with the rigs that it mounts."""
        from vision.cameras.record import place_world_with_rigs

        return place_world_with_rigs(self, path)

    def in_volume(
        self,
        volume: Volume,
        *,
        level: str = "part",
        world: str | None = None,
        precision: str = "box",
        wholly: bool = False,
    ) -> Contents:
        """What lies in a volume, by columns: `in_volumes` of one."""
        return self.in_volumes([volume], level=level, world=world, precision=precision, wholly=wholly)

    in_volumes = _as_contents(find.in_volumes)
    nearest_parts = _as_contents(find.nearest_parts)

    def inspect(
        self,
        *,
        rig: str | Path,
        pictures: Pictures | None = None,
        prior: str | Path | None = None,
        carrier: Carrier | None = None,
        serial: str | None = None,
        operator: str | None = None,
        **options: Unpack[Options],
    ) -> Inspection:
        """Inspect pictures that the cameras of a rig took together: `vision.inspection.inspection.inspect`.

        A notebook shows the answer as the model drawn over the pictures.  What is computed from the model is kept for
        the next call, until the model changes or the store is closed.

        rig, prior: files.
        pictures: one to sixteen by the names of their cameras, files or arrays (grey, RGB or RGBA of bytes, of 16 bits,
        or of floats from 0 to 1); or one alone where the rig has one camera.
        carrier: what is known of the arm that carries the rig.
        serial: number of the physical part, by which its inspections add up.
        operator: who makes the inspection (default: the user of this machine).
        options: needs, world, against, standpoints instead of pictures, ...: `relmodel.app.session.Options`."""
        from relmodel.app.session import Session

        return Session(self._scenes, rig, options).inspect(
            pictures=pictures, prior=prior, carrier=carrier, serial=serial, operator=operator
        )

    @cached_property
    def _scenes(self) -> Scenes:
        from vision.scene import Scenes

        return Scenes(self)

    def close(self) -> None:
        """Close the store, and let go of what inspections kept; any later use raises StoreError."""
        self.__dict__.pop("_scenes", None)
        super().close()

    def session(self, *, rig: str | Path, **options: Unpack[Options]) -> Session:
        """Inspect again and again with one rig; the answers are those of `inspect`.

        with store.session(rig="rig.yaml") as session:
            answers = [session.inspect(pictures={"left": left, "right": right}) for left, right in pairs]"""
        from relmodel.app.session import Session
        from vision.scene import Scenes

        return Session(Scenes(self), rig, options)

    def plan(self, *, rig: str | Path, out: str | Path | None = None, **wanted: Unpack[PlanOptions]) -> Plan:
        """The views that would check most of an object, or of what is left of the physical part of a serial number.

        out: a folder for a prior of each view and their lists, pairs.csv and standpoints.csv.
        wanted: serial, object, world, on, distance, above and views: `vision.planning.Wanted`."""
        from relmodel.app.propose import propose_views

        return propose_views(self, Path(rig), wanted, None if out is None else Path(out))

    def query(self, statement: str, *, time_limit_s: float = TIME_LIMIT_S) -> Table:
        """The result of one SELECT, WITH, VALUES, TABLE or EXPLAIN, stopped after `time_limit_s` seconds."""
        return Table(ask_arrow(self, statement, time_limit_s=time_limit_s))

    def results(self, run: int | None = None) -> dict[str, Table]:
        """The tables of what an inspection found, by name; without `run` of the newest."""
        from relmodel.app.audit import run_named
        from relmodel.app.export import read_results

        with self.read() as connection:
            tables = read_results(self, connection, run_named(self, connection, run))
        return {name: Table(found) for name, found in tables.items()}

    def report(self, out: str | Path, **of: Unpack[Subject]) -> Path:
        """Write a report page and return its path.

        of: run, serial, object and variant, or diff: `relmodel.app.report.write.Subject`; without any of these it is of
        the newest inspection."""
        from relmodel.app.report.write import write_report

        write_report(self, Path(out), of)
        return Path(out)

    def export(
        self,
        out: str | Path,
        *,
        run: int | None = None,
        object: str | None = None,
        variant: str = "",
        tables: str = "parquet",
    ) -> list[Path]:
        """Write what an inspection found (without `run` the newest) as .qif, .json or .glb, or an object as .glb.

        Any other name is a folder for tables, `parquet` or `csv`.  Returns the files."""
        from relmodel.app.audit import run_named
        from relmodel.app.export import export_object, export_run, read_results

        with self.read() as connection:
            if object is not None:
                return export_object(self, connection, object, variant, Path(out), tables)
            results = read_results(self, connection, run_named(self, connection, run))
            return export_run(self, connection, results, Path(out), tables)

    def accept(self, finding: int, *, by: str, note: str, run: int | None = None) -> str:
        """Record that the part may be used with a finding (without `run`, of the newest inspection); that in words."""
        from relmodel.app.decide import decide

        return decide(self, run, finding, "accepted", by, note)

    def reject(self, finding: int, *, by: str, note: str, run: int | None = None) -> str:
        """Record that the part must not be used with a finding, as `accept`."""
        from relmodel.app.decide import decide

        return decide(self, run, finding, "rejected", by, note)

    def why(
        self, run: int | None = None, *, pose: bool = False, arc: str | None = None, feature: str | None = None
    ) -> Table:
        """Why an inspection (without `run` the newest) decided as it did: one sentence a row.

        The sentences are about its verdict, pose, an image arc (CAMERA:NUMBER), or a part or feature by its path."""
        from relmodel.app.audit import Sentence, explain

        return table_of(Sentence._fields, explain(self, run, pose=pose, arc=arc, feature=feature))

    def diff(self, before: str, after: str, *, object: str | None = None, reach: float = REACH) -> Table:
        """What differs between two variants of `object`, or between two OBJECT:VARIANT: one row a difference.

        reach: how far a thing may move and still count as the same, mm.  A comparison that was not made before is
        written to the store."""
        from relmodel.app.report.write import variant_named
        from relmodel.variants.compare import compare

        made = compare(self, variant_named(before, object), variant_named(after, object), reach=reach)
        with self.read() as connection:
            found = connection.execute(sql.query("compare/changes"), {"comparison_id": made.id})
            return table_of(list(found.keys()), found.all())

    def set(
        self,
        path: str,
        name: str,
        value: float | str | bool,
        *,
        unit: str | None = None,
        **whose: Unpack[AttributeOwner],
    ) -> int:
        """Set an attribute of an object, or of what stands in it (OBJECT/PATH).  Nothing is overwritten; the newest
        value counts.  Returns the run that recorded it.

        whose: variant, surface, arc and world: `relmodel.app.attributes.Whose`."""
        from relmodel.app.attributes import set_attribute

        return set_attribute(self, path, name, value, unit, whose).run_id

    def _repr_html_(self) -> str:
        """What the store holds, as a notebook shows it."""
        with self.read() as connection:
            found = connection.execute(sql.query("store/overview"))
            held = table_of(list(found.keys()), found.all())
        return f"<p>the store {escape(visible(self.name))}</p>{held._repr_html_()}"
