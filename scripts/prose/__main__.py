"""`python -m scripts.prose`: what breaks the rules of language, beyond what `allowed.toml` still allows.

`--all [FILE ...]` lists what is allowed as well, `--allow` writes `allowed.toml` anew (counts may only fall), `--count` counts
the words that are written by hand.
"""

import argparse
import sys
import tomllib
from collections import Counter
from collections.abc import Iterable
from pathlib import Path

from scripts.prose.rules import Finding, findings
from scripts.prose.text import of_file
from scripts.reference.pages import GENERATED

ROOT = Path(__file__).parents[2]
ALLOWED = Path(__file__).with_name("allowed.toml")
CODE = ("domain", "proto", "services", "drivemcp", "app", "evaluation", "studies", "training", "benchmarks", "scripts")
Counts = dict[str, dict[str, int]]
"""File to rule to number of findings."""
GOAL = 40_000
"""Words by hand."""


def pages() -> list[Path]:
    """Pages that are written by hand, but for decisions, results and the change log, which are of their time."""
    docs = [
        path
        for path in (ROOT / "docs").rglob("*.md")
        if path.relative_to(ROOT / "docs").parts[0] not in ("decisions", "results")
    ]
    generated = {ROOT / "docs" / "reference" / f"{name}.md" for name in GENERATED}
    return sorted(
        [*(ROOT / name for name in ("README.md", "CONTRIBUTING.md", "SECURITY.md")), *(set(docs) - generated)]
    )


def modules() -> list[Path]:
    """Code whose docstrings are checked."""
    return sorted(path for folder in CODE for path in (ROOT / folder).rglob("*.py"))


def named(file: Path) -> str:
    """The path from the root."""
    return file.relative_to(ROOT).as_posix()


def check(files: Iterable[Path]) -> dict[Path, list[Finding]]:
    """What is found in each file; in code abbreviations are those of its field and not looked at."""
    found = {file: [each for sentence in of_file(file) for each in findings(sentence)] for file in files}
    return {file: [each for each in got if file.suffix == ".md" or each.rule != "names"] for file, got in found.items()}


def counted(found: dict[Path, list[Finding]]) -> Counts:
    """File to rule to count."""
    counts = {named(file): dict(sorted(Counter(each.rule for each in got).items())) for file, got in found.items()}
    return {file: rules for file, rules in counts.items() if rules}


def problems(found: dict[Path, list[Finding]], allowed: Counts) -> list[str]:
    """Lines to print: findings of rules of which a file has more than allowed, and allowances that are too high."""
    lines = []
    for file, got in found.items():
        may, has = allowed.get(named(file), {}), Counter(each.rule for each in got)
        lines += [
            f"{named(file)}:{each.line}: {each.rule}: {each.says}"
            for each in got
            if has[each.rule] > may.get(each.rule, 0)
        ]
        lines += [
            f"{named(file)}: {rule}: {has[rule]} are left, {count} allowed; run: python -m scripts.prose --allow"
            for rule, count in may.items()
            if has[rule] < count
        ]
    gone = set(allowed) - {named(file) for file in found}
    return [*lines, *(f"{file} is gone; run: python -m scripts.prose --allow" for file in sorted(gone))]


def lowered(counts: Counts, allowed: Counts) -> Counts:
    """The counts of today, none above what was allowed."""
    new = {
        file: {rule: min(count, allowed.get(file, {}).get(rule, 0)) for rule, count in rules.items()}
        for file, rules in counts.items()
    }
    return {
        file: kept for file, rules in new.items() if (kept := {rule: count for rule, count in rules.items() if count})
    }


def as_toml(counts: Counts) -> str:
    """The file's content."""
    rows = (
        f'"{file}" = {{ {", ".join(f"{rule} = {count}" for rule, count in rules.items())} }}'
        for file, rules in counts.items()
    )
    return (
        "# Findings that are left in older pages and docstrings, by rule. `python -m scripts.prose --allow` lowers them.\n"
        + "\n".join(rows)
        + "\n"
    )


def count() -> int:
    """Words of the pages."""
    return sum(len(file.read_text(encoding="utf-8").split()) for file in pages())


def main(arguments: list[str]) -> int:
    """0: nothing new."""
    parser = argparse.ArgumentParser(prog="python -m scripts.prose", description=__doc__)
    parser.add_argument("files", nargs="*", type=lambda name: Path(name).resolve(), metavar="FILE")
    for flag in ("--all", "--allow", "--count"):
        parser.add_argument(flag, action="store_true")
    flags = parser.parse_args(arguments)
    if flags.count:
        sys.stdout.write(f"{count()} words by hand; the goal is {GOAL} at most\n")
        return 0
    found = check(flags.files or [*pages(), *modules()])
    allowed = tomllib.loads(ALLOWED.read_text(encoding="utf-8")) if ALLOWED.is_file() else {}
    if flags.files:
        allowed = {name: rules for name, rules in allowed.items() if ROOT / name in found}
    if flags.allow:
        ALLOWED.write_text(as_toml(lowered(counted(found), allowed)), encoding="utf-8")
        return 0
    lines = problems(found, {} if flags.all else allowed)
    sys.stdout.writelines(f"{line}\n" for line in lines)
    return 1 if lines else 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
