"""STEP files (AP203, AP214, AP242): the text is parsed once, the CAD kernel reads the same bytes.

The kernel crashes on many damaged files and takes what memory it wants, so `relmodel.readers.read` runs this in a
child process under limits."""

from __future__ import annotations

import codecs
import gzip
import hashlib
from dataclasses import replace
from io import BytesIO
from pathlib import Path

from relmodel.errors import InputError, missing_library
from relmodel.model.model import Finding, Model, SourceFile
from relmodel.readers.step import part21
from relmodel.readers.step.part21 import Instances, in_utf8

UNPACKED_LIMIT = 2 << 30


def read_step(path: Path) -> Model:
    """Read a STEP file, gzipped or not, into parts, shapes and assemblies; lengths become mm.

    Raises InputError where the file cannot be read, is not STEP or cut off, has a number that is not finite, is
    in no known unit or holds no face."""
    content = path.read_bytes()
    files = (SourceFile(path.name, hashlib.sha256(content).hexdigest()),)
    if path.suffix.lower() == ".gz":
        content = _unpacked(content, path)
    content = content.removeprefix(codecs.BOM_UTF8)
    part21.check_part21(content, str(path))
    content, unread = in_utf8(content)  # the kernel takes other encodings for UTF-8
    instances = Instances(content)
    faces = part21.face_count(instances)
    if faces == 0:
        raise InputError(f"{path} holds no face, neither exact nor of triangles: export its solids as a B-rep")
    part21.check_finite(instances, str(path))
    model = _by_kernel(content, instances, path)
    if model.faces_loaded < faces:  # lost, or of no product from the first
        faces = max(part21.faces_in_use(instances), model.faces_loaded)
    if unread:
        said = f"{len(unread)} text{'s'[: len(unread) > 1]} of the file in no known encoding, such as {unread[0][:80]}"
        model = replace(model, findings=(*model.findings, Finding("unread_text", said)))
    return replace(model, faces_in_file=faces, files=files)


def _by_kernel(content: bytes, instances: Instances, path: Path) -> Model:
    try:
        from relmodel.readers.step import document
        from relmodel.readers.step.triangulation import NoAreaError
    except ModuleNotFoundError as error:
        if error.name != "OCP":
            raise
        raise InputError(
            f"{path} cannot be read without the CAD kernel, which is not installed: pip install 'relmodel[step]'"
        ) from error
    except ImportError as error:
        raise InputError(
            f"{path} cannot be read, as the CAD kernel does not start: {missing}"
            if (missing := missing_library(error))
            else f"{path} cannot be read, as the CAD kernel does not start ({error}): free memory, or install it again"
        ) from error
    try:
        return document.read_document(content, instances)
    except document.UnknownUnitError as error:
        named = f"an unknown unit of length, {error}" if str(error) else "no known unit of length"
        raise InputError(f"{path} is in {named}: export it in one such as the millimetre") from error
    except NoAreaError as error:
        raise InputError(f"{path} holds only triangles without area: export it again") from error
    except document.UnreadableError as error:
        raise InputError(f"{path} could not be read ({error}): export it again") from error


def _unpacked(packed: bytes, path: Path) -> bytes:
    try:
        with gzip.open(BytesIO(packed)) as file:
            content = file.read(UNPACKED_LIMIT + 1)
    except (OSError, EOFError) as error:
        raise InputError(f"{path} cannot be unpacked ({error}): copy it again") from error
    if len(content) > UNPACKED_LIMIT:
        raise InputError(f"{path} unpacks to more than {UNPACKED_LIMIT >> 30} GB: split the assembly")
    return content
