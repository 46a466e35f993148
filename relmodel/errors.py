"""The errors that library code raises; only the command line prints them and sets the exit status.

A message is one sentence that says what was wrong, where, and the cure."""

import re


class RelmodelError(Exception):
    """Anything that relmodel refuses or cannot do.  `exit_status` is what the command line ends with."""

    exit_status = 1


class UsageError(RelmodelError):
    """The call itself is wrong: unknown name, options that do not go together."""

    exit_status = 2


class InputError(RelmodelError):
    """A file, picture, calibration or number handed in is bad; the store is as it was."""

    exit_status = 3


class StoreError(RelmodelError):
    """The store cannot be opened, is locked by another process, or is not a relmodel store."""

    exit_status = 3


class InUseError(StoreError):
    """Another process, or this one in another way, has the store open."""


class TransientError(StoreError):
    """The database refused or lost what may well succeed when it is tried again."""


# Debian's packages of libraries whose names do not follow its rule.
_PACKAGES = {
    "libglib-2.0.so.0": "libglib2.0-0",
    "libgobject-2.0.so.0": "libglib2.0-0",
    "libgthread-2.0.so.0": "libglib2.0-0",
    "libz.so.1": "zlib1g",
}


def missing_library(error: Exception) -> str | None:
    """That a shared library is not installed which a package wants, and what installs it; None for other errors.

    A library's package is named after it (Debian Policy 8.1): libGL.so.1 is in libgl1, libX11.so.6 in libx11-6."""
    found = re.match(r"((lib\S+?)\.so(?:\.(\d+))?[.\d]*): cannot open shared object file: No such file", str(error))
    if found is None:
        return None
    name, stem, version = found.groups()
    by_rule = stem.lower().replace("_", "-") + ("-" if version and stem[-1].isdigit() else "") + (version or "")
    package = _PACKAGES.get(name, by_rule)
    return f"the library {name} is not installed: apt install {package} (Debian, Ubuntu), or what has it on your system"
