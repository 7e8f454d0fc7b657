"""Mutants of the arbiter that no test kills: `make mutation`, or `make mutation ARGS='--sample 30 --seed 7 --of assessment'`.

mutmut makes the mutants in the folder `mutants` and asks of each the tests that run through its function. A survivor is told with its
difference, unless `tests/unit/services/arbiter/survivors.toml` says why no test can tell it from the original.
"""

import argparse
import random
import subprocess
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import Literal, NamedTuple

import msgspec

ROOT = Path(__file__).parents[1]
EXPLAINED = ROOT / "tests/unit/services/arbiter/survivors.toml"
MUTANTS = Path("mutants")
SOURCE = Path("services/arbiter")
MATCHES_NONE = "none"
KILLED, NOT_KILLED = (1, 3), (0, 5)
"""Exit statuses of pytest as mutmut keeps them: a test failed; all passed, or none runs through the function."""
Fate = Literal["killed", "survived", "broken off"]


class Change(NamedTuple):
    """What a mutant changes, by function: its lines before and after. Numbers of lines and of mutants are no part of it."""

    function: str
    before: str
    after: str


class Explained(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A mutant that behaves as the original does, and why."""

    function: str
    before: str
    after: str
    why: str


class Survivors(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """The file of those that are explained."""

    survivor: tuple[Explained, ...] = ()


def main(arguments: Sequence[str] | None = None) -> int:
    """0: as many as asked for are killed or explained; 1: too many survive."""
    parser = argparse.ArgumentParser(prog="make mutation ARGS=", description=__doc__)
    parser.add_argument("--sample", type=int, help="so many, drawn by the seed; without it all")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--of", action="append", default=[], help="of this part of the arbiter alone; more than once")
    parser.add_argument(
        "--at-least", type=float, default=1.0, metavar="SHARE", help="of those tried to be killed or explained (1)"
    )
    parser.add_argument("--jobs", type=int, default=1, help="mutants side by side")
    flags = parser.parse_args(arguments)
    _mutmut("run", "--max-children", str(flags.jobs), MATCHES_NONE)  # makes the mutants, times the tests, tries none
    names = drawn(_names(flags.of), flags.sample, flags.seed)
    if not names:
        sys.stderr.write("there are no mutants\n")
        return 1
    _mutmut("run", "--max-children", str(flags.jobs), *names)
    fates = {name: fate(status) for name, status in _statuses().items() if name in set(names)}
    known = {Change(each.function, each.before, each.after) for each in explained()}
    alive = [name for name in names if fates[name] != "killed" and change(name, _difference(name)) not in known]
    for name in alive:
        sys.stdout.write(f"{name}: {fates[name]}\n{_difference(name)}\n")
    killed = sum(fates[name] == "killed" for name in names)
    sys.stdout.write(
        f"{len(names)} mutants: {killed} killed, {len(names) - killed - len(alive)} explained, {len(alive)} neither\n"
    )
    return int(len(names) - len(alive) < flags.at_least * len(names))


def drawn(names: Sequence[str], count: int | None, seed: int) -> list[str]:
    """So many of them by the seed, or all."""
    ordered = sorted(names)
    return ordered if count is None or count >= len(ordered) else sorted(random.Random(seed).sample(ordered, count))


def fate(status: int | None) -> Fate:
    """By mutmut's exit status of a mutant."""
    return "killed" if status in KILLED else "survived" if status in NOT_KILLED else "broken off"


def change(name: str, difference: str) -> Change:
    """What a mutant of that name changes, from its unified difference."""
    lines = [line for line in difference.splitlines() if not line.startswith(("---", "+++", "#"))]
    before, after = (" ".join(line[1:].strip() for line in lines if line.startswith(sign)) for sign in "-+")
    return Change(name.partition("__mutmut")[0].replace(".x_", "."), before, after)


def explained() -> tuple[Explained, ...]:
    """Those of the file; raises msgspec.ValidationError."""
    return msgspec.toml.decode(EXPLAINED.read_bytes(), type=Survivors).survivor


def _statuses() -> dict[str, int | None]:
    found: dict[str, int | None] = {}
    for file in sorted((MUTANTS / SOURCE).rglob("*.meta")):
        found |= msgspec.json.decode(file.read_bytes())["exit_code_by_key"]
    return found


def _names(parts: Sequence[str]) -> list[str]:
    prefixes = tuple(f"{'.'.join(SOURCE.parts)}.{part}." for part in parts)
    return [name for name in _statuses() if not prefixes or name.startswith(prefixes)]


def _mutmut(*words: str) -> str:
    done = subprocess.run(["mutmut", *words], capture_output=True, text=True, check=False)
    if done.returncode and MATCHES_NONE not in words:
        sys.stderr.write(done.stdout[-4000:] + done.stderr[-4000:])
    return done.stdout


def _difference(name: str) -> str:
    return _mutmut("show", name)


if __name__ == "__main__":
    sys.exit(main())
