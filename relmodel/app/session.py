"""Inspections in a row that share what they make of the model: its scenes, what is looked up in them, and kernels."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self, TypedDict

if TYPE_CHECKING:
    from relmodel.world.correction import Carrier
    from vision.cameras.cameras import Needs
    from vision.cameras.rig_pictures import Pictures
    from vision.inspection.inspection import Inspection
    from vision.scene.kept_scenes import Scenes


class Options(TypedDict, total=False):
    """What inspections in a row have in common, beside the rig.

    needs: how exactly the pose is needed, as in "5mm,2deg".
    world: its name, where the store has several.
    against: names of loaded objects, an empty list for all: say which of them the pictures show; needs no world.
    believe_pictures: accept a pose that the pictures show surely although it contradicts the prior.
    ignore_blind_camera: answer by the other cameras where one does not see the model.
    """

    needs: Needs | str | None
    world: str | None
    against: Sequence[str] | None
    believe_pictures: bool
    ignore_blind_camera: bool


class Session:
    """Inspections with one rig of one world, as `OpenStore.session` says; each sees the newest revision of the world.

    A context manager that lets go of what it keeps when it ends.
    """

    def __init__(self, scenes: Scenes, rig: str | Path, options: Options) -> None:
        from vision.cameras.files import parse_needs
        from vision.inspection.inspection_parameters import InspectionParameters

        given: dict[str, Any] = {"rig": rig, **options}
        if isinstance(given.get("needs"), str):
            given["needs"] = parse_needs(given["needs"], "needs")
        own = {name: given.pop(name) for name in ("believe_pictures", "ignore_blind_camera") if name in given}
        self._scenes, self._given = scenes, given
        self._parameters = InspectionParameters(**own)

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
        from relmodel.world.correction import Carrier
        from vision.inspection.inspection import Task, inspect

        store = self._scenes.store
        task = Task(
            pictures=pictures,
            prior=prior,
            carrier=carrier or Carrier(),
            serial=serial,
            operator=operator,
            **self._given,
        )
        return PicturedInspection(**vars(inspect(store, task, self._parameters, self._scenes)), store=store)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        self._scenes.keep_only(())
