"""The errors that library code raises; only the command line prints them and sets the exit status.

A message is one sentence that says what was wrong, where, and the cure.
"""


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
