"""A store opened by `relmodel.open`: the Python interface over the modules that do the work."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy.typing as npt

from relmodel.find import find
from relmodel.find.volumes import Volume
from relmodel.store import Store
from relmodel.store.ask import TIME_LIMIT_S, ask_arrow
from relmodel.table import Table

if TYPE_CHECKING:
    from relmodel.app.session import Session
    from relmodel.loading.write.write import LoadReport
    from relmodel.world.correction import Carrier
    from relmodel.world.placement import WorldReport
    from vision.cameras.cameras import Needs
    from vision.inspection.inspection import Inspection


class OpenStore(Store):
    """A store to query, and to fill where it is open for writing; a context manager that closes it.

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

    def in_volume(
        self,
        volume: Volume,
        *,
        level: str = "part",
        world: str | None = None,
        precision: str = "box",
        kind: str = "rtree",
        wholly: bool = False,
    ) -> dict[str, npt.NDArray[Any]]:
        """What lies in a volume, by columns: `relmodel.find.find.in_volume`."""
        return find.in_volume(self, volume, level=level, world=world, precision=precision, kind=kind, wholly=wholly)

    def in_volumes(
        self,
        volumes: Sequence[Volume],
        *,
        level: str = "part",
        world: str | None = None,
        precision: str = "box",
        kind: str = "rtree",
        wholly: bool = False,
    ) -> dict[str, npt.NDArray[Any]]:
        """What lies in each of some volumes, by columns: `relmodel.find.find.in_volumes`."""
        return find.in_volumes(self, volumes, level=level, world=world, precision=precision, kind=kind, wholly=wholly)

    def nearest_parts(
        self,
        path: npt.ArrayLike,
        count: int = 1,
        *,
        radius: float = 0.0,
        tool: npt.ArrayLike = (0.0, 0.0, 0.0),
        world: str | None = None,
    ) -> dict[str, npt.NDArray[Any]]:
        """The parts nearest to a point, a part or a tool's way, by columns: `relmodel.find.find.nearest_parts`."""
        return find.nearest_parts(self, path, count, radius=radius, tool=tool, world=world)

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
        ignore_blind_camera: bool = False,
    ) -> Inspection:
        """Inspect a stereo pair, or the picture of the left camera: `vision.inspection.inspection.inspect`.

        against: names of loaded objects, all where there are none: which of them the pictures show, with no world.
        believe_pictures: accept a pose that the pictures show surely where it contradicts the prior.
        ignore_blind_camera: answer by the other cameras where one does not see the model.  A notebook shows the answer
        with the model drawn over the pictures.
        """
        with self.session(
            rig=rig,
            needs=needs,
            world=world,
            against=against,
            believe_pictures=believe_pictures,
            ignore_blind_camera=ignore_blind_camera,
        ) as session:
            return session.inspect(left=left, right=right, prior=prior, carrier=carrier)

    def session(
        self,
        *,
        rig: str | Path,
        needs: Needs | None = None,
        world: str | None = None,
        against: Sequence[str] | None = None,
        believe_pictures: bool = False,
        ignore_blind_camera: bool = False,
    ) -> Session:
        """Inspect one pair after the other with one rig: what is made of the model is kept between them, and the
        answers are those of `inspect`.

            with store.session(rig="rig.yaml") as session:
                answers = [session.inspect(left=left, right=right) for left, right in pairs]
        """
        from relmodel.app.session import Session

        return Session(
            self,
            rig=rig,
            needs=needs,
            world=world,
            against=against,
            believe_pictures=believe_pictures,
            ignore_blind_camera=ignore_blind_camera,
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
