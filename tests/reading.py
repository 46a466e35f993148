"""Reading and loading in the process of the tests: a child takes a second to begin, and equal files are read once.

What a STEP file gives is kept in a folder that all workers of one run share."""

from __future__ import annotations

import hashlib
import os
import pickle
import threading
import uuid
from dataclasses import replace
from functools import partial
from pathlib import Path

from relmodel.loading import load as loading
from relmodel.loading.load import derive
from relmodel.loading.write import LoadReport, write
from relmodel.model.content_keys import share
from relmodel.model.model import Model, SourceFile
from relmodel.model.validation import validated
from relmodel.readers import DEFAULTS, ReadOptions, read
from relmodel.readers.formats import format_of
from relmodel.store import Run, Store

_turn = threading.Lock()  # loaders ask for files side by side, as children would read them


def read_here(path: Path, options: ReadOptions = DEFAULTS, *, anew: bool = False) -> Model:
    """The model of a file, read in this process; a STEP file once for all tests, unless `anew`."""
    folder = os.environ.get("RELMODEL_TESTS_READ")  # a benchmark has none
    if folder is None or format_of(path) != "step" or not path.is_file():
        return read(path, options, in_child=False)
    content = path.read_bytes()
    kept = Path(folder) / hashlib.sha256(content).hexdigest()
    with _turn:
        if anew or not kept.exists():
            own = kept.with_name(uuid.uuid4().hex)
            own.write_bytes(pickle.dumps(read(path, options, in_child=False), protocol=5))
            own.replace(kept)
        model: Model = pickle.loads(kept.read_bytes())
    return replace(model, files=(replace(model.files[0], name=path.name),))


def shared(path: Path) -> Model:
    """The model of a file with the sharing that it has lost found again."""
    return share(read_here(path))


load = partial(loading.load, reader=read_here)
load_all = partial(loading.load_all, reader=read_here)


def store_model(store: Store, model: Model, name: str, variant: str = "") -> LoadReport:
    """Store a model that comes from no file."""
    file = SourceFile(f"{name}-{variant}", hashlib.sha256(variant.encode()).hexdigest())
    with Run.begin(store, "load", {}) as run, run.write() as connection:
        derived = derive(validated(replace(model, files=(file,))), store, connection)
        return write(run, connection, derived, name, variant)
