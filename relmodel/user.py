"""Who works at this machine."""

from __future__ import annotations

import getpass


def user_name() -> str | None:
    """The name of the user of this process; None where it has none, as in some containers."""
    try:
        return getpass.getuser()
    except (KeyError, OSError):
        return None
