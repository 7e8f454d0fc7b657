"""The router: Zenoh's own, in a process of ours. `python -m drivemcp.bus.router --listen tcp/127.0.0.1:7447`"""

import argparse
import json
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drivemcp.bus.session import open_bus
from drivemcp.config import BusConfig
from drivemcp.errors import BusError, UserError
from drivemcp.files.modes import deny_others
from drivemcp.runtime.parent import end_with_parent


def access_settings(access_file: str, credentials_file: str) -> dict[str, object]:
    """Zenoh settings of generated access control and of its users. Raises UserError when a file is absent or broken."""
    if not access_file:
        return {}
    try:
        rules: dict[str, Any] = json.loads(Path(access_file).read_text(encoding="utf-8"))
    except OSError as error:
        raise UserError(f"cannot read {access_file}: {error.strerror}; make it with: drivemcp access") from None
    except ValueError as error:
        raise UserError(f"{access_file} is no JSON: {error}") from None
    if not Path(credentials_file).is_file():
        raise UserError(f"no credentials at {credentials_file!r}; make them with: drivemcp access")
    return {"access_control": rules, "transport/auth/usrpwd/dictionary_file": credentials_file}


def main(arguments: Sequence[str] | None = None) -> int:
    """Route until SIGTERM."""
    parser = argparse.ArgumentParser(prog="drivemcp.bus.router", description=__doc__)
    parser.add_argument("--listen", action="append", required=True, metavar="ENDPOINT")
    parser.add_argument("--access", default="", metavar="FILE", help="generated access control (drivemcp access)")
    parser.add_argument("--credentials", default="", metavar="FILE", help="user:password lines")
    flags = parser.parse_args(arguments)
    deny_others()
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    end_with_parent()
    try:
        extra = access_settings(flags.access, flags.credentials)
        with open_bus(BusConfig(listen=tuple(flags.listen)), mode="router", extra=extra):
            stop.wait()
    except (UserError, BusError) as error:
        sys.stderr.write(f"router: {error}\n")
        return 2
    return 0


if __name__ == "__main__":
    sys.exit(main())
