"""An extraction in the store: written once, read by its content."""

import hashlib
from dataclasses import dataclass
from typing import TYPE_CHECKING

from relmodel.columns import Columns
from relmodel.store.database import Database
from relmodel.store.runs import Run
from vision.extraction.extract import VERSION
from vision.extraction.extraction_parameters import ExtractionParameters
from vision.extraction.primitives import Primitives
from vision.extraction.rows import Tables

if TYPE_CHECKING:
    from sqlalchemy import Connection

    from vision.cameras.images import Picture

# The tables that refer to the set of units, not to the extraction.
_OF_UNITS = ("unit", "unit_relation")


@dataclass(frozen=True)
class RecordedExtraction:
    """Identities of an extraction and of its set of units (arcs by number first, then regions)."""

    extraction_id: int
    unit_set_id: int


def content_key(picture: "Picture", parameters: ExtractionParameters) -> str:
    """What makes two extractions the same: image, the bits that were taken of it, parameters and version."""
    bits = "" if picture.bits == picture.depth else f" {picture.bits} bits"
    return hashlib.sha256(f"{picture.sha256}{bits} {parameters.to_json()} {VERSION}".encode()).hexdigest()


def find_extraction(
    store: Database, connection: "Connection", picture: "Picture", parameters: ExtractionParameters
) -> RecordedExtraction | None:
    """The extraction of that picture with those parameters, if the store holds it."""
    rows = store.rows(connection, "extraction/by_key", content_key=content_key(picture, parameters))
    return RecordedExtraction(int(rows[0].id), int(rows[0].unit_set_id)) if rows else None


def read_primitives(store: Database, connection: "Connection", extraction_id: int) -> Primitives:
    """What later stages take of an extraction."""
    tables = {
        table: store.columns(connection, f"extraction/{table}", extraction_id=extraction_id)
        for table in Primitives.TABLES
    }
    shape = tables["extraction"]["rows"][0], tables["extraction"]["columns"][0]
    return Primitives.of((int(shape[0]), int(shape[1])), tables)


def record_extraction(
    run: Run,
    connection: "Connection",
    image_id: int,
    picture: "Picture",
    parameters: ExtractionParameters,
    tables: Tables,
) -> RecordedExtraction:
    """Append all rows of an extraction of image `image_id`; where the store holds the same already, its identities."""
    if not run.is_rehearsal and (found := find_extraction(run.store, connection, picture, parameters)):
        return found
    extraction_id = int(run.new_ids(connection, "extraction", 1)[0])
    unit_set_id = int(run.new_ids(connection, "unit_set", 1)[0])
    head: Columns = {
        "id": [extraction_id],
        "image_id": image_id,
        "content_key": content_key(picture, parameters),
        "bits": picture.bits,
        "bits_from": picture.bits_from,
        "parameters": parameters.to_json(),
        "version": VERSION,
        **tables["extraction"],
    }
    with run.store.one_thread():
        run.append(connection, "extraction", head)
        run.append(connection, "unit_set", {"id": [unit_set_id], "kind": "extraction", "extraction_id": extraction_id})
        for table, columns in tables.items():
            if table in _OF_UNITS:
                run.append(connection, table, {"unit_set_id": unit_set_id, **columns})
            elif table != "extraction":
                run.append(connection, table, {"extraction_id": extraction_id, **columns})
    return RecordedExtraction(extraction_id, unit_set_id)
