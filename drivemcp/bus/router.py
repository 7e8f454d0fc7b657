"""The router: Zenoh's own, in a process of ours. `python -m drivemcp.bus.router --listen tcp/127.0.0.1:7447`"""

import argparse
import json
import os
import signal
import sys
import threading
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from drivemcp.bus.session import open_bus
from drivemcp.bus.tls import AUTHORITY, OWN, usable
from drivemcp.config import BusConfig
from drivemcp.errors import BusError, UserError
from drivemcp.files.modes import deny_others
from drivemcp.runtime.folder_watch import Watch
from drivemcp.runtime.parent import end_with_parent

LOOK_S = 1.0
THREADS = "(rx: (worker_threads: 16))"
"""Zenoh closes a link with a linger of 10 s, which holds a thread where the other side is cut off: with fewer threads than members the
router stands still for tens of seconds after the network is back."""


def access_settings(access_file: str, credentials_file: str) -> dict[str, object]:
    """Zenoh settings of generated access control and of its users. Raises UserError when a file is absent or broken."""
    if not access_file:
        return {}
    try:
        rules: dict[str, Any] = json.loads(Path(access_file).read_text(encoding="utf-8-sig"))
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
    parser.add_argument(
        "--tls", default="", metavar="FOLDER", help="ca.pem and tls.pem for tls/ endpoints (drivemcp access --tls)"
    )
    flags = parser.parse_args(arguments)
    deny_others()
    os.environ.setdefault("ZENOH_RUNTIME", THREADS)
    stop = threading.Event()
    for number in (signal.SIGTERM, signal.SIGINT):
        signal.signal(number, lambda *_: stop.set())
    end_with_parent()
    try:
        while not stop.is_set():
            extra = access_settings(flags.access, flags.credentials)
            with open_bus(BusConfig(listen=tuple(flags.listen), tls_folder=flags.tls), mode="router", extra=extra):
                _wait(stop, flags.tls)
    except (UserError, BusError) as error:
        sys.stderr.write(f"router: {error}\n")
        return 2
    return 0


def _wait(stop: threading.Event, tls_folder: str) -> None:
    """Until SIGTERM, or until there are new certificates: a listener keeps those that it began with."""
    if not tls_folder:
        stop.wait()
        return
    folder, watch = Path(tls_folder), Watch((AUTHORITY, OWN))
    watch.remember([folder])
    while not stop.wait(LOOK_S):
        if watch.changed([folder]):
            try:
                usable(folder)
            except UserError as error:
                sys.stderr.write(f"router: the old certificates stay in use: {error}\n")
                continue
            sys.stderr.write("router: listening anew with new certificates\n")
            return


if __name__ == "__main__":
    sys.exit(main())
