"""Everything that is wrong with a pack: what loading refuses, and what only its author can have meant otherwise."""

import itertools
from collections.abc import Iterator
from pathlib import Path
from typing import Any, get_type_hints

import msgspec

from drivemcp.choices import nearest
from drivemcp.files.packfiles import ASKED, FILES, SOURCES, Asked
from proto.rules import RightOfWayQuestion, RulesAnswer, SignMeaning, Situation
from services.rules.authoring.seal import paragraphs
from services.rules.authoring.vocabulary import check_words
from services.rules.errors import Problem
from services.rules.packs.files import Files, decoded, decoded_list, read_files
from services.rules.packs.format import Case, Manifest, Provision, Sign
from services.rules.packs.json_positions import repeated
from services.rules.packs.loading import examine
from services.rules.packs.remedies import remedy_for
from services.rules.packs.signature import Trust
from services.rules.signs.meaning import SignQuestion

CASES_ASK = {"applicable_limit": Situation, "right_of_way": RightOfWayQuestion, "interpret_sign": SignQuestion}
MOST_UNKNOWN = 20
"""Names of a file that nothing is called by are told; more are no slips."""
EXPECTED = {"limit", "advisory", "cites", "contains", "min_confidence", "max_confidence"}


def validated(folder: Path, trust: Trust | None = None) -> tuple[Problem, ...]:
    """What is wrong, in the order of the files; none: the pack loads and its parts fit together."""
    _, problems = examine(folder, trust)
    files = read_files(folder, (ASKED,))
    manifest, _ = decoded(files, "manifest.json", Manifest)
    provisions, _ = decoded_list(files, "provisions.json", Provision)
    signs, _ = decoded_list(files, "signs.json", Sign)
    words = check_words(files, manifest, provisions, signs)
    twice = (problem for name in (*FILES, ASKED) for problem in _twice(files, name))
    asked = _asked(files, {entry.id for entry in provisions if entry} | {f"sign:{sign.code}" for sign in signs if sign})
    return (*problems, *twice, *_names(files, manifest), *words, *_paragraphs(files), *_cases(files), *asked)


def _names(files: Files, manifest: Manifest | None) -> Iterator[Problem]:
    if manifest is not None and manifest.id != files.folder.absolute().name:
        message = f"{manifest.id!r} is not the folder's name, by which others find it"
        yield files.problem(
            "manifest.json", ("id",), message, f"write {files.folder.absolute().name!r}, or rename the folder"
        )


def _twice(files: Files, name: str) -> Iterator[Problem]:
    """Of a name that stands twice in one object JSON takes the last without a word."""
    if name not in files.content or decoded(files, name, Any)[1]:
        return
    for path in repeated(files.text(name)):
        yield files.problem(name, path, "stands twice, and the last one counts", "remove one of them")


def _paragraphs(files: Files) -> Iterator[Problem]:
    """Every text in the documents belongs to a provision or a sign."""
    provisions, wrong = decoded_list(files, "provisions.json", Provision)
    signs, wrong_signs = decoded_list(files, "signs.json", Sign)
    if wrong or wrong_signs:
        return
    used = {entry.id for entry in provisions if entry} | {f"sign:{entry.code}" for entry in signs if entry}
    for name in sorted(name for name in files.content if name.startswith(SOURCES)):
        text = files.text(name)
        for entry, (_, start, _) in paragraphs(text).items():
            if entry not in used:
                line = text.count("\n", 0, start) - 1
                remedy = nearest(entry, used) or "give it an entry in provisions.json or signs.json, or remove the text"
                yield Problem(
                    file=files.folder / name, line=line, message=f"nothing is called [{entry}]", remedy=remedy
                )


def _asked(files: Files, names: set[str]) -> Iterator[Problem]:
    """How drivers ask is of what the pack has, in languages that questions can have."""
    if ASKED not in files.content:
        yield from [files.absent(ASKED)] if ASKED in files.refused else []
        return
    asked, problems = decoded(files, ASKED, Asked)
    yield from problems
    for name in itertools.islice((name for name in asked or {} if name not in names), MOST_UNKNOWN):
        remedy = nearest(name, names) or "write the id of a provision, or `sign:` and a code of signs.json"
        yield files.problem(ASKED, (name,), f"nothing is called {name}", remedy)


def _cases(files: Files) -> Iterator[Problem]:
    """Questions and expectations name fields that there are: a misspelt fact would count as unknown."""
    cases, _ = decoded_list(files, "cases.json", Case)
    for index, case in enumerate(cases):
        if case is None:
            continue
        kind = CASES_ASK[case.tool]
        known = set(kind.__struct_fields__)
        for field in case.ask:
            if field not in known:
                remedy = nearest(field, known) or f"remove it, or write one of {', '.join(sorted(known))}"
                yield files.problem("cases.json", (index, "ask", field), "there is no such fact", remedy, case.name)
        try:
            msgspec.convert(case.ask, kind)
        except msgspec.ValidationError as error:
            yield files.problem("cases.json", (index, "ask"), str(error), remedy_for(error, kind), case.name)
        answered = EXPECTED | set(get_type_hints(SignMeaning if case.tool == "interpret_sign" else RulesAnswer))
        for field in case.expect:
            if field not in answered:
                remedy = nearest(field, answered) or f"remove it, or write one of {', '.join(sorted(answered))}"
                yield files.problem(
                    "cases.json", (index, "expect", field), "no answer has this field", remedy, case.name
                )
