"""The pictures of an inspection with what was extracted from them: from the store where it has it, else made and stored
before anything goes on from it."""

from __future__ import annotations

from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

from sqlalchemy import Connection

from relmodel.store import Run
from vision.cameras.images import Picture
from vision.cameras.record_cameras import record_picture
from vision.extraction.extract import extract
from vision.extraction.extraction_parameters import ExtractionParameters
from vision.extraction.primitives import Primitives
from vision.extraction.record_extraction import RecordedExtraction, find_extraction, read_primitives, record_extraction
from vision.extraction.rows import Tables, make_rows


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
    """Pictures by camera with their extractions; of equal pictures there is one.  The store is let go of while
    extracting, and at the end."""
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

    seen = run.transact(write)
    store.release()
    return seen


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
