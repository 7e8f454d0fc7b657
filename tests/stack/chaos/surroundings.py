"""Surroundings of a drive that lack something: each names what a command is run by, or skips where this machine cannot."""

import os
import shutil
import subprocess
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest

from tests.stack.chaos.drive import Drive


def run(*command: str, told: str | None = None) -> None:
    """One command of the system; its complaint is the test's."""
    done = subprocess.run(command, input=told, capture_output=True, text=True, timeout=20, check=False)
    assert done.returncode == 0, f"{' '.join(command)}: {done.stderr}"


def needs_root(*commands: str) -> None:
    """Skip where something is missing."""
    if os.geteuid() != 0:
        pytest.skip("needs root")
    if missing := [each for each in commands if shutil.which(each) is None]:
        pytest.skip(f"needs {', '.join(missing)}")


class Network:
    """A network of its own: its loopback is the drive's, and nothing else is in it."""

    def __init__(self, name: str) -> None:
        self.inside = ("ip", "netns", "exec", name)

    @contextmanager
    def losing(self, drive: Drive, percent: int) -> Iterator[None]:
        """Each packet from and to the router is lost with this chance; 100: it is cut off."""
        stack = drive.stack()
        chance = "" if percent == 100 else f"numgen random mod 100 < {percent} "
        port = stack.endpoint.rpartition(":")[2]
        lines = "\n".join(f"add rule inet chaos wire tcp {way} {port} {chance}drop" for way in ("dport", "sport"))
        run(*self.inside, "nft", "-f", "-", told=(
            "add table inet chaos\nadd chain inet chaos wire { type filter hook input priority 0 ; }\n" + lines + "\n"
        ))  # fmt: skip
        try:
            yield
        finally:
            run(*self.inside, "nft", "delete", "table", "inet", "chaos")


@contextmanager
def network() -> Iterator[Network]:
    """A network namespace; gone at the end."""
    needs_root("ip", "nft")
    name = f"drivemcp-chaos-{os.getpid()}"
    run("ip", "netns", "add", name)
    try:
        run("ip", "-n", name, "link", "set", "lo", "up")
        try:
            run("ip", "netns", "exec", name, "nft", "add", "table", "inet", "probe")
        except AssertionError as error:
            pytest.skip(f"nftables cannot be used here: {error}")
        yield Network(name)
    finally:
        run("ip", "netns", "delete", name)


@contextmanager
def small_disk(folder: Path, megabytes: int) -> Iterator[None]:
    """A disk of a few megabytes in place of a folder."""
    needs_root("mount", "umount")
    folder.mkdir(parents=True)
    run("mount", "-t", "tmpfs", "-o", f"size={megabytes}m,mode=0750", "tmpfs", str(folder))
    try:
        yield
    finally:
        run("umount", "--lazy", str(folder))


def without_shared_memory() -> tuple[str, ...]:
    """/dev/shm takes no writes, for this command alone."""
    needs_root("unshare", "mount")
    script = 'mount --make-rprivate / && mount -t tmpfs -o ro,size=4k tmpfs /dev/shm && exec "$@"'
    return ("unshare", "--mount", "sh", "-c", script, "sh")


def few_files(number: int) -> tuple[str, ...]:
    """No process of the drive opens more than so many files."""
    if shutil.which("prlimit") is None:
        pytest.skip("needs prlimit")
    return ("prlimit", f"--nofile={number}:{number}")


class Clock:
    """The time of day of a drive's processes alone: a library in front of the system's adds what a file holds.

    The machine's own clock is never touched. (libfaketime 0.9.10 makes every `time.sleep` of Python 3.11 fail.)
    """

    def __init__(self, folder: Path) -> None:
        compiler = shutil.which("cc")
        if compiler is None:
            pytest.skip("needs a C compiler")
        self._file = folder / "offset"
        library = folder / "clock.so"
        self._file.write_bytes(bytes(8))
        run(compiler, "-shared", "-fPIC", "-O1", "-o", str(library), str(Path(__file__).parent / "clock.c"), "-ldl")
        self.environment = {"LD_PRELOAD": str(library), "CHAOS_CLOCK": str(self._file)}

    def set_s(self, offset_s: int) -> None:
        """So far from the machine's clock, for all at once."""
        with self._file.open("r+b") as file:
            file.write(offset_s.to_bytes(8, "little", signed=True))
