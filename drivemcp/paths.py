"""Where rulepacks, models, DBCs and scenarios lie: relative to the installation, never to the current directory."""

from pathlib import Path

from drivemcp.errors import UserError

_INSTALLED = Path(__file__).parent / "data"
_CHECKOUT = Path(__file__).parent.parent


def data(name: str) -> Path:
    """The path of a data file or folder, for example `data("rulepacks/DEU-v1")`. Raises UserError where it is absent."""
    for root in (_INSTALLED, _CHECKOUT):
        path = root / name
        if path.exists():
            return path
    raise UserError(f"no such data: {name!r} (looked in {_INSTALLED} and {_CHECKOUT}); is the installation complete?")


def has_data(name: str) -> bool:
    """Whether a data file or folder is there."""
    return any((root / name).exists() for root in (_INSTALLED, _CHECKOUT))
