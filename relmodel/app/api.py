"""A store opened by `relmodel.open`: all that a person does with one in Python, over the modules that do it."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from relmodel.find.indexed_store import IndexedStore
from relmodel.store.ask import TIME_LIMIT_S, ask_arrow
from relmodel.table import Table

if TYPE_CHECKING:
    from relmodel.loading.write.write import LoadReport
    from relmodel.world.correction import Carrier
    from relmodel.world.placement import WorldReport
    from vision.cameras.cameras import Needs
    from vision.inspection.inspection import Inspection


class OpenStore(IndexedStore):
    """A store that is asked, and filled where it is open for writing; a context manager that closes it.

    Lengths are mm and angles rad; transforms `a_from_b` are 4x4 arrays.  What is wrong is raised as InputError (a file
    or number), UsageError (the call) or StoreError (the store), each one sentence.
    """

    def load(
        self, path: str | Path, *, name: str, variant: str = "", unit: str | None = None, occluder: bool = False
    ) -> LoadReport:
        """Load a STEP, mesh or URDF file under a name and a variant: `relmodel.loading.load.load`."""
        from relmodel.loading.load import load

        return load(self, path, name=name, variant=variant, unit=unit, occluder=occluder)

    def place(self, path: str | Path) -> WorldReport:
        """Place the world of a world file, with the rigs that it mounts."""
        from vision.cameras.world import place_world_with_rigs

        return place_world_with_rigs(self, path)

    def inspect(
        self,
        *,
        rig: str | Path,
        left: str | Path,
        right: str | Path | None = None,
        prior: str | Path | None = None,
        needs: Needs | None = None,
        world: str | None = None,
        against: Sequence[str] | None = None,
        carrier: Carrier | None = None,
        believe_pictures: bool = False,
    ) -> Inspection:
        """Inspect a stereo pair, or the left camera alone: `vision.inspection.inspection.inspect`.

        against: names of loaded objects, all where there are none: which of them the pictures show, with no world.
        believe_pictures: accept a pose that the pictures show surely where it contradicts the prior.  A notebook shows
        the answer with the model drawn over the pictures.
        """
        from relmodel.app.notebook import inspect_with_picture
        from vision.inspection.inspection_parameters import InspectionParameters

        return inspect_with_picture(
            self,
            rig=rig,
            left=left,
            right=right,
            prior=prior,
            needs=needs,
            world=world,
            against=against,
            carrier=carrier,
            parameters=InspectionParameters(believe_pictures=believe_pictures),
        )

    def query(self, statement: str, *, time_limit_s: float = TIME_LIMIT_S) -> Table:
        """The result of one SELECT, WITH, VALUES, TABLE or EXPLAIN, stopped after `time_limit_s` seconds."""
        return Table(ask_arrow(self, statement, time_limit_s=time_limit_s))

    def results(self, run: int | None = None) -> dict[str, Table]:
        """The tables of what an inspection found, the newest where `run` names none, by name."""
        from relmodel.app.audit.newest import newest_inspection
        from relmodel.app.export.results import read_results

        with self.read() as connection:
            tables = read_results(self, connection, newest_inspection(self, connection) if run is None else run)
        return {name: Table(found) for name, found in tables.items()}
