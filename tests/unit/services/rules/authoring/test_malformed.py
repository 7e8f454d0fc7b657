"""Malformed packs: each is refused at once, with its file and field and with what to do."""

import json
import os
import re
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.cli import run
from drivemcp.files.packfiles import FILES, MAX_BYTES, MAX_DOCUMENTS, content_sha256
from services.retrieval.corpus import CorpusError, read_pack
from services.rules.authoring.seal import seal
from services.rules.authoring.validate import validated
from services.rules.errors import PackError
from services.rules.packs.loading import content_hash, examine, extended_folders, load
from tests.unit.services.rules.editing import edit

Said = pytest.CaptureFixture[str]
Break = Callable[[Path], Any]


def changed(file: str, change: Callable[[Any], Any]) -> Break:
    return lambda pack: edit(pack / file, lambda content: change(content) and None)


def written(file: str, content: bytes) -> Break:
    return lambda pack: (pack / file).write_bytes(content)


def linked(file: str) -> Break:
    def break_it(pack: Path) -> None:
        (pack / file).rename(pack.parent / "elsewhere")
        (pack / file).symlink_to(pack.parent / "elsewhere")

    return break_it


def piped(file: str) -> Break:
    def break_it(pack: Path) -> None:
        (pack / file).unlink(missing_ok=True)
        os.mkfifo(pack / file)

    return break_it


def many_documents(pack: Path) -> None:
    for number in range(MAX_DOCUMENTS):
        (pack / "sources" / f"{number}.md").touch()


def effect(change: Callable[[Any], Any]) -> Break:
    return changed("provisions.json", lambda p: change(p[0]["effects"]))


YIELD = {"type": "right_of_way", "action": "yield"}
LIMIT = {"type": "limit", "value": 50, "unit": "km/h"}
MALFORMED: dict[str, tuple[Break, str, str]] = {
    "a pipe": (piped("signs.json"), "signs.json", "no regular file; remove it"),
    "a pipe among the documents": (piped("sources/x.md"), "sources/x.md", "no regular file; remove it"),
    "a pipe for a signature": (piped("signature.json"), "signature.json", "no regular file; remove it"),
    "a link": (linked("provisions.json"), "provisions.json", "is a link; put the file itself there"),
    "a linked folder": (linked("sources"), "sources", "is a link; put the folder itself there"),
    "a folder": (lambda pack: (pack / "sources/x.md").mkdir(), "sources/x.md", "no regular file; remove it"),
    "too large": (written("cases.json", b" " * (MAX_BYTES + 1)), "cases.json", "more than 4 MiB; divide it"),
    "too many": (many_documents, "sources", "more than 200 documents; put several"),
    "absent": (lambda pack: (pack / "cases.json").unlink(), "cases.json", "is not there; put it there"),
    "empty": (written("signs.json", b""), "signs.json", "truncated; the file ends too early"),
    "no comma": (written("signs.json", b'[\n{"code": 1}\n{}]'), "signs.json:3", "malformed.*; mend this line"),
    "UTF-16": (written("signs.json", "[]".encode("utf-16")), "signs.json", "; save the file as JSON in UTF-8"),
    "Latin-1": (written("signs.json", '["Überholverbot"]'.encode("latin-1")), "signs.json", "; save the file as JSON"),
    "a document in Latin-1": (
        written("sources/law.de.md", "# Recht\n\n§ 1\n".encode("latin-1")), "sources/law.de.md:3", "; save the file as UTF-8",
    ),
    "nested deeply": (written("cases.json", b"[" * 100_000), "cases.json", "recursion.*; nest it less deeply"),
    "an object for a list": (written("cases.json", b"{}"), "cases.json:1", "got `object`; give a list in square"),
    "an entry that is a number": (changed("cases.json", lambda c: c.append(3)), "cases.json", r"\]: .*; give an object in"),
    "an unknown field": (
        changed("provisions.json", lambda p: p[0].update(sectoin="x")), "provisions.json", r"`sectoin`; write \"section\"",
    ),
    "a field too much": (
        changed("manifest.json", lambda m: m.update(zzzzzz=1)), "manifest.json", "unknown field `zzzzzz`; remove it",
    ),
    "an unknown condition": (
        effect(lambda e: e.append(LIMIT | {"when": {"road_type": []}})), "provisions.json", r"; write \"road_types\"",
    ),
    "a field too little": (changed("signs.json", lambda s: s[0].pop("shape")), "signs.json", "; add 'shape'"),
    "an unknown class": (
        effect(lambda e: e.append(LIMIT | {"when": {"vehicle_classes": ["lory"]}})), "provisions.json",
        r"vehicle_classes\[0\].*'lory'; give one of .*\"lorry\"",
    ),
    "an unknown unit": (
        changed("manifest.json", lambda m: m.update(units="kmh")), "manifest.json", r"units: .*'kmh'; give one of \"km/h\"",
    ),
    "another unit": (effect(lambda e: e.append(LIMIT | {"unit": "mph"})), "provisions.json", "mph is not.*; write km/h"),
    "no such speed": (effect(lambda e: e.append(LIMIT | {"value": 999})), "provisions.json", "; give a number <= 300"),
    "a speed in words": (
        effect(lambda e: e.append(LIMIT | {"value": "fast"})), "provisions.json", r"effects\[\d+\]\.value.*; give a number",
    ),
    "half a span": (effect(lambda e: e.append(LIMIT | {"when": {"hours": [1]}})), "provisions.json", "; give 2 values"),
    "no day": (
        effect(lambda e: e.append(LIMIT | {"when": {"period": ["1 May", "05-02"]}})), "provisions.json", "; write it as in 11-15",
    ),
    "a long road": (
        effect(lambda e: e.append(LIMIT | {"when": {"roads": ["A" * 99]}})), "provisions.json", "; shorten it to 16",
    ),
    "no version": (changed("manifest.json", lambda m: m.update(version="1")), "manifest.json", "; write it as in 1.2.3"),
    "no hash": (changed("manifest.json", lambda m: m.update(content_sha256="")), "manifest.json", "drivemcp rulepack seal"),
    "no date": (
        changed("manifest.json", lambda m: m.update(effective_from="2025-13-01")), "manifest.json", "; write it as in 2025-",
    ),
    "no country": (
        changed("manifest.json", lambda m: m.update(jurisdiction="Italy")), "manifest.json", "; write it as in ITA or USA-CA",
    ),
    "another name": (changed("manifest.json", lambda m: m.update(id="B-v1")), "manifest.json", "; write 'ITA-v1', or rename"),
    "no languages": (changed("manifest.json", lambda m: m.update(languages=[])), "manifest.json", "is empty; name the"),
    "limits upside down": (
        changed("manifest.json", lambda m: m["plausible_limits"].update(urban=[50, 20])), "manifest.json", "; write the lower",
    ),
    "an orphaned child": (
        changed("manifest.json", lambda m: m.update(extends={"id": "NO-v1", "version": "1.0.0"})), "NO-v1/manifest.json",
        "is not there; put it there",
    ),
    "no effects": (effect(lambda e: e.clear() or True), "provisions.json", r"effects .*is empty; give at least one"),
    "no sources": (
        changed("provisions.json", lambda p: p[0].update(sources=[])), "provisions.json", "is empty; give at least one",
    ),
    "another document": (
        changed("provisions.json", lambda p: p[0]["sources"][0].update(document="sources/law.ene.md")), "provisions.json",
        r"; write \"sources/law.en.md\"",
    ),
    "outside": (
        changed("provisions.json", lambda p: p[0]["sources"][0].update(document="../x.md")), "provisions.json", "; put it into",
    ),
    "other offsets": (
        changed("signs.json", lambda s: s[0]["sources"][0].update(start=3)), "signs.json", "; after an edit run: drivemcp",
    ),
    "twice": (changed("signs.json", lambda s: s.append(s[0])), "signs.json", "stands there twice; remove one"),
    "a field twice": (
        lambda pack: (pack / "manifest.json").write_text(
            (pack / "manifest.json").read_text(encoding="utf-8").replace('"units"', '"units": "mph", "units"'), encoding="utf-8"
        ), "manifest.json", "units: stands twice.*; remove one",
    ),
    "an unknown provision": (
        changed("signs.json", lambda s: s[0].update(provisions=["ita-speed-towns"])), "signs.json",
        r"; write \"ita-speed-town\"",
    ),
    "a plate for all": (
        changed("signs.json", lambda s: s[0].update(plate={"type": "vehicle"})), "signs.json", "; list the classes of vehicle",
    ),
    "a case about nothing": (
        changed("cases.json", lambda c: c[0]["ask"].update(visibilty_m=3)), "cases.json", r"; write \"visibility_m\"",
    ),
    "a case that asks wrongly": (
        changed("cases.json", lambda c: c[0]["ask"].update(wet="yes")), "cases.json", "; give true or false or null",
    ),
    "a case that expects nothing": (
        changed("cases.json", lambda c: c[0]["expect"].update(limt=3)), "cases.json", r"; write \"limit\"",
    ),
    "an unknown light": (
        effect(lambda e: e.append(YIELD | {"trigger": "light:gren"})), "provisions.json", r"\.trigger .*; write \"light:green\"",
    ),
    "an unknown sign of a trigger": (
        effect(lambda e: e.append(YIELD | {"trigger": "sign:stopp"})), "provisions.json", r"; write \"sign:stop\"",
    ),
    "an unknown way to read signs": (
        effect(lambda e: e.append({"type": "condition", "what": "posted_limt"})), "provisions.json",
        r"\.what .*; write \"posted_limit\".*, or other:posted_limt",
    ),
    "an unknown prohibition": (
        effect(lambda e: e.append({"type": "prohibition", "what": "overtakin"})), "provisions.json", r"; write \"overtaking\"",
    ),
    "an unknown sign of a prohibition": (
        effect(lambda e: e.append({"type": "prohibition", "what": "entry", "sign": "no_entri"})), "provisions.json",
        r"\.sign .*; write \"no_entry\"",
    ),
    "an unknown sign": (changed("signs.json", lambda s: s[0].update(code="limt")), "signs.json", r"\.code .*; write \"limit\""),
    "an unknown language": (
        changed("manifest.json", lambda m: m["languages"].append("ita")), "manifest.json", "; write one of two letters, as in .*it",
    ),
    "a text in another language": (
        changed("signs.json", lambda s: s[0]["meaning"].update(it="Limite")), "signs.json",
        r"\.meaning\.it .*; write one of en, de, fr, or name it",
    ),
    "no signature": (written("signature.json", b"{}"), "signature.json", "; add 'pack_id'"),
}  # fmt: skip
UNREAD = [
    name for name, (_, _, told) in MALFORMED.items() if "is a link" in told or "regular" in told or "more" in told
]


@pytest.mark.parametrize("name", MALFORMED)
def test_a_malformed_pack_is_told_with_its_file_and_with_what_to_do(name: str, pack: Path) -> None:
    break_it, file, wanted = MALFORMED[name]
    break_it(pack)
    told = validated(pack)
    found = [str(problem) for problem in told]
    assert any(f"/{file}" in line and re.search(wanted, line) for line in found), found
    assert all(problem.message and problem.remedy for problem in told)
    assert all(";" not in problem.message for problem in told), "the remedy stands behind the only semicolon"
    if name != "a field twice":  # JSON's own rule, which only an author can have meant otherwise
        with pytest.raises(PackError):
            load(pack)


@pytest.mark.parametrize(
    ("content", "wanted"),
    [
        (b'{"ita-speed-urbn": {"it": ["quanto in paese"]}}', r"asked.json:1.*nothing is called ita-speed-urbn; write"),
        (b'{"TOWN": {"Italian": ["quanto in paese"]}}', r"asked.json.*Italian|asked.json.*match"),
        (b'{"TOWN": {"it": "quanto in paese"}}', r"asked.json.*; give .* in square"),
        (b'{"TOWN": {"it": [""]}}', r"asked.json.*; "),
        (b'{"TOWN": ', r"asked.json.*truncated"),
        (b'{"TOWN": {"it": ["in paese"]}, "TOWN": {"it": ["in citt"]}}', r"asked.json.*stands twice"),
        (b'{"TOWN": {"it": ["in\\u202epaese"]}}', r"asked.json.*; "),
    ],
)
def test_words_of_drivers_that_fit_nothing_are_told_and_the_law_loads(pack: Path, content: bytes, wanted: str) -> None:
    first = json.loads((pack / "provisions.json").read_text("utf-8"))[0]["id"]
    before = content_hash(pack)
    (pack / "asked.json").write_bytes(content.replace(b"TOWN", first.encode()))
    found = [str(problem) for problem in validated(pack)]
    assert any(re.search(wanted, line) for line in found), found
    assert content_hash(pack) == before


def test_words_of_drivers_that_fit_are_no_problem(pack: Path) -> None:
    first = json.loads((pack / "provisions.json").read_text("utf-8"))[0]["id"]
    before = validated(pack)
    (pack / "asked.json").write_text(json.dumps({first: {"it": ["quanto in paese"]}}), encoding="utf-8")
    assert validated(pack) == before


@pytest.mark.parametrize("name", UNREAD)
def test_no_service_and_no_command_waits_for_or_follows_what_is_no_file(name: str, pack: Path) -> None:
    MALFORMED[name][0](pack)
    for use in (content_hash, seal):
        with pytest.raises(PackError):
            use(pack)
    assert extended_folders(pack) == ()
    if "signature" not in name:
        with pytest.raises(CorpusError):
            read_pack(pack)


def test_a_pipe_keeps_no_process_waiting(pack: Path) -> None:
    """In a process of its own, which is ended: a reader that waits for a pipe waits for ever."""
    for file in ("manifest.json", "signs.json", "sources/x.md", "signature.json"):
        (pack / file).unlink(missing_ok=True)
        os.mkfifo(pack / file)
    command = [sys.executable, "-m", "drivemcp.cli", "rulepack", "validate", str(pack)]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 1
    assert done.stdout.count("is no regular file; remove it") == 4


def test_a_thousand_mistakes_are_told_in_time_that_grows_with_their_number(pack: Path) -> None:
    """Where each stands is looked up in one reading of the file, not in one for each."""
    entries = json.loads((pack / "signs.json").read_text(encoding="utf-8"))
    wrong = [entry | {"code": f"danger_{number}", "action": "fly"} for number in range(100) for entry in entries[:20]]
    (pack / "signs.json").write_text(json.dumps(wrong), encoding="utf-8")
    assert sum("'fly'; give one of" in str(problem) for problem in validated(pack)) == 2000


def test_byte_order_marks_and_carriage_returns_change_nothing(pack: Path) -> None:
    before = load(pack)
    for path in (*pack.glob("*.json"), *pack.glob("sources/*.md")):
        path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes().replace(b"\n", b"\r\n"))
    assert validated(pack) == ()
    assert load(pack) == before
    assert read_pack(pack)
    assert seal(pack) == before.manifest.content_sha256


def test_a_pack_is_written_and_sealed_with_carriage_returns(pack: Path) -> None:
    path = pack / "sources" / "law.en.md"
    text = path.read_text(encoding="utf-8").replace("faster than 50 km/h", "faster than fifty")
    path.write_bytes(b"\xef\xbb\xbf" + text.replace("\n", "\r\n").encode())
    seal(pack)
    assert validated(pack) == ()
    assert load(pack).provisions["ita-speed-town"].sources[0].excerpt.endswith("faster than fifty.")


def test_a_hash_that_was_made_of_a_mark_stays_valid_with_its_offsets(pack: Path) -> None:
    """Packs sealed before marks were left out count a document's mark as its first character."""
    path = pack / "sources" / "law.en.md"
    path.write_bytes(b"\xef\xbb\xbf" + path.read_bytes())

    def shift(entries: list[dict[str, Any]]) -> None:
        for source in (source for entry in entries for source in entry["sources"]):
            if source["document"] == "sources/law.en.md":
                source["start"] += 1
                source["end"] += 1

    edit(pack / "provisions.json", shift)
    edit(pack / "manifest.json", lambda m: m.update(content_sha256=old_hash(pack)))
    assert validated(pack) == ()
    assert load(pack).manifest.content_sha256 == old_hash(pack)
    assert seal(pack) == old_hash(pack)


def old_hash(pack: Path) -> str:
    """Documents as their bytes are."""
    values = {name: json.loads((pack / name).read_text(encoding="utf-8")) for name in FILES}
    return content_sha256(
        values, {f"sources/{path.name}": path.read_bytes() for path in (pack / "sources").glob("*.md")}
    )


def test_the_command_says_it_all_and_fails(pack: Path, capsys: Said) -> None:
    changed("manifest.json", lambda m: m.update(units="kmh"))(pack)
    piped("cases.json")(pack)
    assert run(["rulepack", "validate", str(pack)]) == 1
    assert len(capsys.readouterr().out.splitlines()) == 2


@settings(max_examples=100, suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(
    file=st.sampled_from([*FILES, "sources/law.en.md"]),
    at=st.floats(0, 1),
    length=st.integers(0, 40),
    put=st.binary(max_size=8),
)
def test_whatever_bytes_are_disturbed_validate_tells_and_never_breaks(
    file: str, at: float, length: int, put: bytes, pack: Path
) -> None:
    before = (pack / file).read_bytes()
    begin = int(at * len(before))
    try:
        (pack / file).write_bytes(before[:begin] + put + before[begin + length :])
        told = validated(pack)
        loads = examine(pack)[0] is not None
    finally:
        (pack / file).write_bytes(before)
    assert loads or told
    assert all(problem.message and problem.remedy for problem in told)
