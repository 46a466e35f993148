"""The pictures of an inspection with what was extracted from them, what is wrong with them, and how many are kept."""

from __future__ import annotations

import ctypes
import platform
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from functools import cache
from itertools import permutations

import numpy as np
from sqlalchemy import Connection

from relmodel.arrays import Bytes, Floats, Floats32
from relmodel.store import Run
from relmodel.store.database import Database
from vision.cameras.cameras import Rig
from vision.cameras.images import Picture
from vision.cameras.record import record_picture
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import ExtractionParameters
from vision.extraction.rows import (
    Primitives,
    RecordedExtraction,
    Tables,
    find_extraction,
    make_rows,
    read_primitives,
    record_extraction,
)
from vision.localisation.localise import Localisation
from vision.localisation.verdict import Verdict
from vision.localisation.views import Observation
from vision.localisation.visibility import SurfaceMap, map_surfaces
from vision.scene import Scene

_TRIM_THRESHOLD, _MMAP_THRESHOLD = -1, -3  # glibc's numbers of the options, in malloc.h


@cache
def return_memory() -> None:
    """Have glibc's allocator return what is freed: arrays of a megabyte and more at once, and what is free at the end
    of a thread's arena from two megabytes on.

    Left alone it raises both limits with each large array that is freed, to 32 and 64 MB, for each of some sixteen
    arenas: 150 MB and more after a few inspections.  Nothing where there is no glibc."""
    if platform.libc_ver()[0] == "glibc":
        allocator = ctypes.CDLL(None)
        allocator.mallopt(_MMAP_THRESHOLD, 1 << 20)
        allocator.mallopt(_TRIM_THRESHOLD, 2 << 20)


# What is the matter with a picture before anything is said of what it shows: stale, covered, blurred, saturated, raw.
#
# Each is a number of a row of `inspection_image`; `find_faults` holds them against `PictureParameters`.

FINE_PX, COARSE_PX = 1.0, 3.0  # sigmas of the Gaussians that the slopes of edges are measured with
SHARPEST = 0.5  # a picture is as blurred as this quantile of its strong edges
BRIGHTEST = 254.999  # grey
MODEL_STEP_PX = 4  # between the pixels of a model that are looked at


@dataclass(frozen=True)
class PictureParameters:
    """From where on a picture is refused, or noted.

    The limits lie between what pictures of the trials have and the same spoiled: benchmarks/results/localisation.md."""

    least_edges: float = 1.0  # edge elements to a thousand pixels, below which a camera is taken as covered
    most_blur_px: float = 3.5  # sigma of the spread of edges beyond which neighbouring edges merge and move
    noted_blur_px: float = 2.5  # the same from which it is said
    most_saturated: float = 0.65  # share of the pixels at the brightest value
    noted_saturated: float = 0.2  # the same from which it is said
    most_mosaic: float = 1.0  # grey by which pixels differ in a pattern of two by two: no other picture has .02


@dataclass(frozen=True)
class Quality:
    """What a picture is like.

    edges: edge elements to a thousand pixels; blur_px: sigma of the spread of its strong edges, NaN where it has none;
    saturated: share of pixels at the brightest value, where that passes the limit of those that show the model found;
    mosaic: as `measure_mosaic` gives it; stale_run: an earlier run that had this camera's picture beside another one of
    another camera, this run where another camera was given the same file, else None."""

    edges: float
    blur_px: float
    saturated: float
    mosaic: float
    stale_run: int | None


@dataclass(frozen=True)
class Fault:
    """What is the matter with a camera's picture, a sentence; whether the picture says nothing for it."""

    camera: str
    words: str
    refuses: bool


def measure_blur(grey: Floats) -> float:
    """Sigma (px) of the spread of the strong edges of a picture (rows, columns), 0..255; NaN where it has none.

    The slope of a straight edge that is spread by s is, seen by a Gaussian of sigma t and by differences two pixels
    wide, as 1 / sqrt(s^2 + t^2 + 1/3): its ratio for two t gives s."""
    import cv2

    def slopes(sigma: float) -> Floats32:
        smooth = cv2.GaussianBlur(grey.astype(np.float32), (0, 0), sigma)
        x, y = (cv2.Sobel(smooth, cv2.CV_32F, *axis, scale=0.125) for axis in ((1, 0), (0, 1)))
        return np.asarray(np.hypot(x, y), np.float32)

    fine, coarse = slopes(FINE_PX), slopes(COARSE_PX)
    # On the ridge of the slope alone: beside it both are less, and the coarse one less so.
    ridge = fine >= cv2.dilate(fine, np.ones((5, 5), np.uint8))
    strong = fine[ridge & (fine > 2.0)]
    if len(strong) < 20:
        return float("nan")
    here = ridge & (fine >= max(float(np.quantile(strong, 0.8)), 2.0))
    ratio = (np.maximum(fine[here] / coarse[here], 1.0 + 1e-6)) ** 2
    own = FINE_PX**2 + 1 / 3, COARSE_PX**2 + 1 / 3
    spread = np.maximum((own[1] - ratio * own[0]) / (ratio - 1), 0.0)
    return float(np.sqrt(np.quantile(spread, SHARPEST)))


def measure_mosaic(grey: Floats) -> float:
    """By how much grey the pixels of one diagonal of two by two differ from those of the other, in the mean over a
    picture (rows, columns): the green ones of a Bayer mosaic from red and blue."""
    rows, columns = (size // 2 * 2 for size in grey.shape)
    block = grey[:rows, :columns].reshape(rows // 2, 2, columns // 2, 2).mean(axis=(0, 2))
    return float(abs(block[0, 0] + block[1, 1] - block[0, 1] - block[1, 0]) / 2)


def measure_quality(run: int, store: Database, rig: Rig, seen: Mapping[str, SeenPicture]) -> dict[str, Quality]:
    """What the pictures of a run are like, by camera of the rig.  The store is let go of."""
    stale = _find_stale(run, store, rig, {name: it.picture for name, it in seen.items()})
    store.release()
    return {name: describe(it.picture.grey, it.primitives, stale.get(name)) for name, it in seen.items()}


def describe(grey: Floats, found: Primitives, stale_run: int | None) -> Quality:
    """What a picture is like: its grey (rows, columns), 0..255, and what was extracted from it."""
    edges = 1000 * len(found.elements.x) / grey.size
    return Quality(edges, measure_blur(grey), float((grey > BRIGHTEST).mean()), measure_mosaic(grey), stale_run)


def _find_stale(run: int, store: Database, rig: Rig, pictures: Mapping[str, Picture]) -> dict[str, int]:
    """The run that had a camera's picture before, of the cameras of which that says that it is stale; this run, of
    cameras of different places that were given one picture.

    The same pictures of all cameras once more are no matter.  One camera alone may be shown a picture again."""
    pairs = list(permutations(pictures, 2))
    place = rig.rig_from_camera
    stale = {
        name: run
        for name, beside in pairs
        if pictures[name].sha256 == pictures[beside].sha256 and not np.array_equal(place[name], place[beside])
    }
    if stale or not pairs or rig.moved is not None:  # of standpoints some may be left out, or others be beside them
        return stale
    with store.read() as connection:
        for name, beside in pairs:
            asked = {"camera": name, "sha256": pictures[name].sha256}
            asked |= {"other_camera": beside, "other_sha256": pictures[beside].sha256}
            if found := store.rows(connection, "cameras/stale_picture", run=run, **asked):
                stale[name] = min(int(found[0].run_id), stale.get(name, run))
    return stale


def in_light_of_model(
    quality: Mapping[str, Quality], seen: Observation, scene: Scene, found: Localisation, p: PictureParameters
) -> dict[str, Quality]:
    """What pictures are like, those that are too bright altogether by what shows of the model that was found: a white
    table behind it is no matter."""
    assert found.best is not None
    bright = [name for name in seen.pictures if quality[name].saturated > p.most_saturated]
    rig, pose = found.rig, found.best.world_from_rig
    shown = {it: map_surfaces(scene, rig.cameras[it], pose @ rig.rig_from_camera[it]) for it in bright}
    saturated = {it: measure_brightness(seen.greys[it], surfaces) for it, surfaces in shown.items()}
    return {name: replace(it, saturated=saturated.get(name, it.saturated)) for name, it in quality.items()}


def measure_brightness(grey: Floats | Bytes, shown: SurfaceMap) -> float:
    """Share of what a picture (rows, columns), 0..255, shows of a model that is at the brightest value."""
    x, y = (it.ravel() for it in np.meshgrid(*(np.arange(0, size, MODEL_STEP_PX) for size in grey.shape[::-1])))
    of_model = shown.surface_at(np.column_stack([x, y]).astype(float)) >= 0
    return float((grey[y, x][of_model] > BRIGHTEST).mean()) if of_model.any() else 0.0


def find_faults(quality: Mapping[str, Quality], run: int, p: PictureParameters) -> list[Fault]:
    """What is the matter with the pictures of a run."""
    faults = []
    other = "the other camera" if len(quality) == 2 else "another camera"
    for name, q in quality.items():
        if q.stale_run == run:
            words = f"camera {name} was given the picture that {other} was given: give each its own"
            faults.append(Fault(name, words, True))
        elif q.stale_run is not None:
            words = f"camera {name} shows the picture of run {q.stale_run}, and {other} another: take a new one"
            faults.append(Fault(name, words, True))
        if q.edges < p.least_edges:
            words = f"camera {name} shows next to nothing: {q.edges:.2g} edge elements to a thousand pixels "
            faults.append(Fault(name, words + f"({p.least_edges:g} needed): is it covered?", True))
        if q.mosaic > p.most_mosaic:
            words = f"the picture of camera {name} is a raw Bayer mosaic: its pixels differ by {q.mosaic:.0f} grey in "
            faults.append(
                Fault(name, words + "a pattern of two by two: have the camera or its driver demosaic it", True)
            )
        if q.blur_px > p.noted_blur_px:
            words = f"the picture of camera {name} is blurred: its edges are spread by {q.blur_px:.1f} px "
            faults.append(Fault(name, words + f"({p.most_blur_px:g} allowed): focus it", q.blur_px > p.most_blur_px))
        if q.saturated > p.noted_saturated:
            words = f"the picture of camera {name} is overexposed: {q.saturated:.0%} of it is as bright as can be "
            refuses = q.saturated > p.most_saturated
            faults.append(Fault(name, words + f"({p.most_saturated:.0%} allowed): expose it less", refuses))
    return faults


def doubt_pictures(verdict: Verdict, faults: Sequence[Fault]) -> Verdict:
    """The verdict where pictures say nothing: refused, and that said first."""
    grave = [fault.words for fault in faults if fault.refuses]
    return verdict.refused(*grave) if grave else verdict


def name_grave(faults: Sequence[Fault]) -> dict[str, str]:
    """By camera whose picture says nothing, why."""
    return {it.camera: it.words for it in faults if it.refuses}


# The pictures of an inspection with what was extracted from them: from the store where it has it, else made and stored
# before anything goes on from it.


@dataclass(frozen=True)
class SeenPicture:
    """A picture, its row, the identities of its extraction, and what that found."""

    picture: Picture
    image_id: int
    recorded: RecordedExtraction
    primitives: Primitives


def extract_pictures(
    run: Run, pictures: dict[str, Picture], parameters: ExtractionParameters, *, keep_images: bool
) -> dict[str, SeenPicture]:
    """Pictures by camera with their extractions, one of equal ones.  Extracting, the store is let go of."""
    store = run.store
    with store.read() as connection:
        known = {
            name: found
            for name, picture in pictures.items()
            if not run.is_rehearsal and (found := find_extraction(store, connection, picture, parameters))
        }
        read = {name: read_primitives(store, connection, it.extraction_id) for name, it in known.items()}
    store.release()
    made = _extract({_key(it): it for name, it in pictures.items() if name not in known}, parameters)

    def write(connection: Connection) -> dict[str, SeenPicture]:
        seen: dict[str, SeenPicture] = {}
        new: dict[_Key, tuple[RecordedExtraction, Primitives]] = {}
        for name, picture in pictures.items():
            image_id, key = record_picture(run, connection, picture, keep_bytes=keep_images), _key(picture)
            if name not in known and key not in new:
                recorded = record_extraction(run, connection, image_id, picture, parameters, made[key])
                new[key] = recorded, Primitives.of((picture.height, picture.width), made[key])
            seen[name] = SeenPicture(picture, image_id, *((known[name], read[name]) if name in known else new[key]))
        return seen

    return run.transact(write)


_Key = tuple[str, int]


def _key(picture: Picture) -> _Key:
    """What an extraction of a picture depends on."""
    return picture.sha256, picture.bits


def _extract(pictures: dict[_Key, Picture], parameters: ExtractionParameters) -> dict[_Key, Tables]:
    """Rows of the extractions of all pictures, made side by side: the kernels run without the interpreter's lock."""
    if not pictures:
        return {}
    with ThreadPoolExecutor(max_workers=len(pictures)) as pool:
        work = {
            name: pool.submit(lambda grey: make_rows(extract(grey, parameters)), picture.grey)
            for name, picture in pictures.items()
        }
        return {name: task.result() for name, task in work.items()}
