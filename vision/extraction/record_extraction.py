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

# The tables of its primitives, in the order in which later stages take their rows.
_ORDER = {
    "edge_element": "edge_element_no",
    "image_arc": "image_arc_no",
    "image_arc_point": "image_arc_no point_no",
    "image_region": "region_no",
    "region_outline": "region_no ring_no point_no",
    "region_arc": "region_no image_arc_no side",
}
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
    head = store.select(connection, "extraction", "image_id", "grey_dark", "grey_bright", id=extraction_id)
    image = store.select(connection, "image", "height", "width", id=int(head["image_id"][0]))
    units = store.select(connection, "unit_set", "id", extraction_id=extraction_id)
    tables = {
        table: store.select(connection, table, order=order, extraction_id=extraction_id)
        for table, order in _ORDER.items()
    }
    relations = store.select(connection, "unit_relation", order="kind unit_a unit_b", unit_set_id=int(units["id"][0]))
    shape = int(image["height"][0]), int(image["width"][0])
    return Primitives.of(shape, {**tables, "extraction": head, "unit_relation": relations})


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
