"""A process of a stack ends with the one that started it, however that one ends."""

import ctypes
import os
import signal
import sys
import threading

PARENT = "DRIVEMCP_PARENT"
"""Environment variable: the process id of the supervisor. Its child heeds it; what the child starts has another parent."""
GRACE_S = 8.0
"""How long a child may take to end in order: as long as the supervisor would wait, and some."""
_LOOK_S = 0.5
_PR_SET_PDEATHSIG = 1


def end_with_parent() -> None:
    """From now on this process gets SIGTERM when its supervisor is gone, and SIGKILL where it still runs then after a while.

    Call it once SIGTERM is handled. Nothing happens where no supervisor started this process.
    """
    parent = os.environ.get(PARENT, "")
    if not parent.isdecimal() or os.getppid() not in (int(parent), 1):
        return
    if sys.platform == "linux":
        ctypes.CDLL(None, use_errno=True).prctl(_PR_SET_PDEATHSIG, signal.SIGTERM, 0, 0, 0)
    threading.Thread(target=_watch, args=(int(parent),), name="parent-watch", daemon=True).start()


def _watch(parent: int) -> None:
    """Also where the system has no such signal, or the parent was gone before it was asked for."""
    pause = threading.Event()
    while os.getppid() == parent:
        pause.wait(_LOOK_S)
    os.kill(os.getpid(), signal.SIGTERM)
    pause.wait(GRACE_S)
    os.kill(os.getpid(), signal.SIGKILL)
