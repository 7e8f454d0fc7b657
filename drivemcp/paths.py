"""Where rulepacks, models, DBCs and scenarios lie: relative to the installation, never to the current directory.

And where this user's keys lie: in the user's state folder, outside every drive's folder.
"""

import os
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


def own_state(name: str) -> Path:
    """A file or folder of this user that outlives drives, below `XDG_STATE_HOME` or `~/.local/state`.

    Raises UserError without a home.
    """
    base = os.environ.get("XDG_STATE_HOME") or ""
    try:
        return (Path(base) if base else Path.home() / ".local" / "state") / "drivemcp" / name
    except RuntimeError:
        raise UserError("this user has no home folder: set XDG_STATE_HOME to a folder for keys") from None
