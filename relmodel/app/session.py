"""Inspections in a row that share what they make of the model: its scenes, what is looked up in them, and kernels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Self

if TYPE_CHECKING:
    from relmodel.world.correction import Carrier
    from vision.cameras.cameras import Needs
    from vision.cameras.rig_pictures import Pictures
    from vision.inspection.inspection import Inspection
    from vision.scene.kept_scenes import Scenes


class Session:
    """Inspections with one rig of one world, as `OpenStore.session` says; each sees the newest revision of the world.

    A context manager that lets go of what it keeps when it ends.
    """

    def __init__(
        self,
        scenes: Scenes,
        *,
        rig: str | Path,
        needs: Needs | str | None,
        world: str | None,
        against: Sequence[str] | None,
        believe_pictures: bool,
        ignore_blind_camera: bool,
    ) -> None:
        from vision.cameras.files import parse_needs
        from vision.inspection.inspection_parameters import InspectionParameters

        self._scenes = scenes
        needs = parse_needs(needs, "needs") if isinstance(needs, str) else needs
        self._given = {"rig": rig, "needs": needs, "world": world, "against": against}
        self._parameters = InspectionParameters(
            believe_pictures=believe_pictures, ignore_blind_camera=ignore_blind_camera
        )

    def inspect(
        self,
        *,
        pictures: Pictures,
        prior: str | Path | None = None,
        carrier: Carrier | None = None,
        serial: str | None = None,
        operator: str | None = None,
    ) -> Inspection:
        """Inspect pictures that were taken together, as `OpenStore.inspect`; what fails leaves the session as it
        was."""
        from relmodel.app.notebook import PicturedInspection
        from vision.inspection.inspection import inspect

        store = self._scenes.store
        found = inspect(
            store,
            pictures=pictures,
            prior=prior,
            carrier=carrier,
            serial=serial,
            operator=operator,
            parameters=self._parameters,
            scenes=self._scenes,
            **self._given,
        )
        return PicturedInspection(**vars(found), store=store)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._scenes.keep_only(())
