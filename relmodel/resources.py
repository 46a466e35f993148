"""Where the project's SQL files and demonstration data lie: next to the package in a checkout, inside it in a wheel."""

from pathlib import Path

_PACKAGE = Path(__file__).parent
_WHEEL_DATA = _PACKAGE / "data"


def resource_dir(name: str) -> Path:
    """Folder `schema`, `queries`, `migrations` or `demo` of this installation."""
    if _WHEEL_DATA.is_dir():
        return _WHEEL_DATA / name
    checkout = _PACKAGE.parent
    return checkout / "examples" / "demo" if name == "demo" else checkout / name
