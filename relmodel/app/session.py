"""Inspections in a row that share what they make of the model, and kernels compiled behind while a model loads."""

from __future__ import annotations

import hashlib
import os
import sys
from collections.abc import Callable, Sequence
from contextlib import suppress
from pathlib import Path
from subprocess import DEVNULL, Popen
from typing import TYPE_CHECKING, Any, Self, TypedDict

import relmodel

if TYPE_CHECKING:
    from relmodel.world.kinematics import Carrier
    from vision.cameras.cameras import Needs
    from vision.cameras.images import Pictures
    from vision.cameras.standpoints import Standpoints
    from vision.inspection.answer import Inspection
    from vision.scene import Scenes


class Options(TypedDict, total=False):
    """What inspections in a row have in common, beside the rig, and may have of their own.

    needs: how exactly the pose is needed, as in "5mm,2deg".
    world: its name, where the store has several.
    against: names of loaded objects, an empty list for all: say which of them the pictures show; needs no world.
    believe_pictures: accept a pose that the pictures show surely although it contradicts the prior.
    ignore_blind_camera: answer by the other cameras where one does not see the model.
    standpoints: instead of pictures, those of one unmoving object from several places of the rig (`docs/rig.md`): a
    file, or a list of mappings with name, pictures, world_from_rig (or joints) and sigma (or covariance).
    ignored: names of standpoints to leave out.
    match: also match arcs and regions of the pictures to the model's by their relations."""

    needs: Needs | str | None
    world: str | None
    against: Sequence[str] | None
    believe_pictures: bool
    ignore_blind_camera: bool
    standpoints: Standpoints | None
    ignored: Sequence[str]
    match: bool


class Session:
    """Inspections with one rig of one world, as `OpenStore.session` says; each sees the newest revision of the world.

    A context manager that lets go of what it keeps when it ends."""

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
        pictures: Pictures | None = None,
        prior: str | Path | None = None,
        carrier: Carrier | None = None,
        serial: str | None = None,
        operator: str | None = None,
    ) -> Inspection:
        """Inspect pictures taken together, as `OpenStore.inspect`; what fails leaves the session as it was."""
        from relmodel.app.notebook import PicturedInspection
        from relmodel.world.kinematics import Carrier
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


# The kernels of inspections, compiled by a process of its own while a model loads: the first inspection finds them.

_WORK = (
    "import os; os.nice(5); from relmodel.compiled import compile_ahead; from vision.inspection import KERNELS; "
    "compile_ahead(KERNELS, lambda words: None)"
)


def compile_behind(say: Callable[[str], None]) -> None:
    """Start compiling, once for each installation, and say so; it goes on when this process ends.

    To know whether it was started before costs no import of numba.  `compile_ahead` waits for it."""
    with suppress(OSError, RuntimeError):  # where nothing can be kept there is no use in it
        base = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "relmodel"
        asked = Path(os.environ.get("NUMBA_CACHE_DIR") or base) / f"asked-{_installation()}"
        if asked.exists():
            return
        asked.parent.mkdir(parents=True, exist_ok=True)
        asked.touch()
        say("compiling the kernels of inspections in the background, once for this version ...")
        command = [sys.executable, "-c", _WORK]
        Popen(command, stdin=DEVNULL, stdout=DEVNULL, stderr=DEVNULL, start_new_session=True)


def _installation() -> str:
    """What changes whenever other kernels are installed: names, sizes and times of their files."""
    top = Path(relmodel.__file__).parent.parent
    files = sorted(file for package in ("relmodel", "vision") for file in (top / package).rglob("*kernels.py"))
    stats = [(os.fspath(file), os.stat(file)) for file in files]
    stated = repr((sys.executable, [(name, it.st_size, it.st_mtime_ns) for name, it in stats]))
    return hashlib.sha256(stated.encode()).hexdigest()[:16]
