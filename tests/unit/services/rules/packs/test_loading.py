"""Rulepacks: what is shipped is complete and right by its own offsets; what is broken is refused with file and field."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from drivemcp.paths import data
from services.rules.authoring.validate import validated
from services.rules.book import RuleBook, load_book
from services.rules.errors import PackError
from services.rules.packs.loading import content_hash, load
from tests.unit.services.rules.editing import edit, rehash

PACKS = sorted(path.parent.name for path in data("rulepacks").glob("*/manifest.json"))
NATIONAL = ("DEU-v1", "GBR-v1")
Copy = Callable[[str], Path]


@pytest.mark.parametrize("name", NATIONAL)
def test_a_national_pack_holds_25_provisions_and_40_signs(name: str) -> None:
    pack = load(data(f"rulepacks/{name}"))
    assert len(pack.provisions) >= 25
    assert len(pack.signs) >= 40


def test_germany_holds_80_provisions_and_150_signs() -> None:
    pack = load(data("rulepacks/DEU-v1"))
    assert len(pack.provisions) >= 80
    assert len(pack.signs) >= 150


def test_great_britain_holds_80_provisions_and_120_signs() -> None:
    pack = load(data("rulepacks/GBR-v1"))
    assert len(pack.provisions) >= 80
    assert len(pack.signs) >= 120


@pytest.mark.parametrize("name", ["BEL-v1", "IRL-v1", "ITA-v1", "ESP-v1"])
def test_later_packs_hold_70_provisions_100_signs_and_100_cases(name: str) -> None:
    pack = load(data(f"rulepacks/{name}"))
    assert len(pack.provisions) >= 70
    assert len(pack.signs) >= 100
    assert len(pack.cases) >= 100


@pytest.mark.parametrize("name", PACKS)
def test_every_excerpt_is_the_documents_text_between_its_offsets(name: str) -> None:
    folder = data(f"rulepacks/{name}")
    own = json.loads((folder / "provisions.json").read_text("utf-8")) + json.loads(
        (folder / "signs.json").read_text("utf-8")
    )
    for entry in own:
        for source in entry["sources"]:
            text = (folder / source["document"]).read_text(encoding="utf-8")
            assert text[source["start"] : source["end"]] == source["excerpt"] != ""


@pytest.mark.parametrize("name", PACKS)
def test_every_shipped_pack_is_right_in_all_its_parts(name: str) -> None:
    assert validated(data(f"rulepacks/{name}")) == ()


@pytest.mark.parametrize("name", PACKS)
def test_every_provision_names_its_section_and_every_sign_speaks_three_languages(name: str) -> None:
    pack = load(data(f"rulepacks/{name}"))
    assert all(provision.section.strip() and provision.effects for provision in pack.provisions.values())
    for sign in pack.signs.values():
        assert {"en", "de", "fr"} <= set(sign.meaning), sign.code
        assert sign.national, sign.code
        assert sign.section, sign.code


def test_german_law_stands_in_german_and_english() -> None:
    for provision in load(data("rulepacks/DEU-v1")).provisions.values():
        assert [source.language for source in provision.sources] == ["de", "en"], provision.id


def test_an_extending_pack_inherits_and_cites_what_it_inherits_under_its_origin(book: RuleBook) -> None:
    pack = book.packs["DEU-v1-VSL"]
    assert "deu-speed-urban" in pack.provisions
    assert pack.origin["deu-speed-urban"].startswith("DEU-v1@")
    assert pack.origin["sign:led"].startswith("DEU-v1-VSL@")


def test_the_version_carries_the_content_hash() -> None:
    pack = load(data("rulepacks/DEU-v1"))
    assert pack.version == f"DEU-v1@{pack.manifest.version}#{content_hash(data('rulepacks/DEU-v1'))[:12]}"


def test_reformatting_json_leaves_the_hash_and_a_changed_character_does_not(copy_pack: Copy) -> None:
    folder = copy_pack("DEU-v1")
    before = content_hash(folder)
    edit(folder / "signs.json", lambda _: None)
    assert content_hash(folder) == before
    path = next((folder / "sources").glob("*.md"))
    path.write_text(path.read_text("utf-8") + " ", encoding="utf-8")
    assert content_hash(folder) != before
    with pytest.raises(PackError, match=r"manifest\.json:2: content_sha256"):
        load(folder)


@pytest.mark.parametrize(
    ("file", "change", "message"),
    [
        ("manifest.json", lambda m: m.update(version="1.0"), r"manifest\.json:\d+: version"),
        ("manifest.json", lambda m: m.update(effective_from="soon"), r"manifest\.json:\d+: effective_from"),
        ("manifest.json", lambda m: m.update(effective_until="2001-01-01"), r"manifest\.json:\d+: effective_until"),
        ("manifest.json", lambda m: m.update(units="knots"), r"manifest\.json:\d+: .*units"),
        ("manifest.json", lambda m: m.update(precedence=["statute"]), r"manifest\.json:\d+: .*precedence"),
        ("manifest.json", lambda m: m.update(surprise=1), r"manifest\.json:\d+: .*surprise"),
        (
            "provisions.json",
            lambda p: p[3].pop("section"),
            r"provisions\.json:\d+: \[3\] \(deu-speed-too-slow\): .*`section`",
        ),
        (
            "provisions.json",
            lambda p: p[0]["sources"][0].update(start=1),
            r"provisions\.json:\d+: \[0\]\.sources\[0\] \(deu-speed-adapt\)",
        ),
        (
            "provisions.json",
            lambda p: p[0]["sources"][0].update(document="../../x"),
            r"provisions\.json:\d+: .*deu-speed-adapt.*outside",
        ),
        (
            "provisions.json",
            lambda p: p[0].update(effects=[{"type": "magic"}]),
            r"provisions\.json:\d+: \[0\]\.effects\[0\].*magic",
        ),
        (
            "provisions.json",
            lambda p: p[1]["effects"].append({"type": "limit", "value": 30, "unit": "mph"}),
            r"provisions\.json:\d+: \[1\]\.effects\[\d+\]\.unit .*: mph is not the unit of DEU, km/h",
        ),
        ("signs.json", lambda s: s[0].update(unit="mph"), r"signs\.json:\d+: \[0\]\.unit \(limit\): mph is not"),
        ("provisions.json", lambda p: p.append(p[0]), r"provisions\.json:\d+: \[\d+\]\.id: .*twice"),
        (
            "signs.json",
            lambda s: s[0].update(provisions=["deu-nowhere"]),
            r"signs\.json:\d+: \[0\]\.provisions\[0\] \(limit\)",
        ),
        (
            "signs.json",
            lambda s: s[0].update(plate={"type": "vehicle"}),
            r"signs\.json:\d+: \[0\]\.plate\.classes \(limit\): .*which",
        ),
        ("signs.json", lambda s: s[0].update(action="fly"), r"signs\.json:\d+: \[0\]\.action.*fly"),
        ("cases.json", lambda c: c[0].update(tool="guess"), r"cases\.json:\d+: \[0\]\.tool.*guess"),
    ],
)
def test_a_broken_pack_is_refused_with_file_and_field(
    copy_pack: Copy, file: str, change: Callable[[Any], Any], message: str
) -> None:
    folder = copy_pack("DEU-v1")
    edit(folder / file, lambda content: change(content) and None)
    rehash(folder)
    with pytest.raises(PackError, match=message):
        load(folder)


@pytest.mark.parametrize("file", ["manifest.json", "provisions.json", "signs.json", "cases.json"])
def test_an_absent_or_garbled_file_is_named(copy_pack: Copy, file: str) -> None:
    folder = copy_pack("GBR-v1")
    (folder / file).write_bytes(b"{nonsense")
    with pytest.raises(PackError, match=file.replace(".", r"\.")):
        load(folder)
    (folder / file).unlink()
    with pytest.raises(PackError, match=file.replace(".", r"\.")):
        load(folder)


def test_a_pack_that_needs_a_newer_parent_is_refused(copy_pack: Copy) -> None:
    copy_pack("DEU-v1")
    folder = copy_pack("DEU-v1-VSL")
    edit(folder / "manifest.json", lambda m: m["extends"].update(version="99.0.0"))
    rehash(folder)
    with pytest.raises(PackError, match=r"extends: needs DEU-v1 99\.0\.0, found \d+\.\d+\.\d+"):
        load(folder)


@pytest.mark.parametrize(
    ("replaces", "message"),
    [
        ((["deu-no-such-thing"], []), r"\[0\]\.replaces\[0\].*no inherited provision 'deu-no-such-thing'"),
        (
            (["deu-speed-urban"], ["deu-speed-urban"]),
            r"\[1\]\.replaces\[0\].*'deu-speed-urban' is replaced by '.*' already",
        ),
    ],
)
def test_what_is_replaced_must_be_inherited_and_is_replaced_once(
    copy_pack: Copy, replaces: tuple[list[str], list[str]], message: str
) -> None:
    copy_pack("DEU-v1")
    folder = copy_pack("DEU-v1-VSL")

    def change(provisions: list[dict[str, Any]]) -> None:
        for provision, names in zip(provisions, replaces, strict=False):
            provision["replaces"] = names

    edit(folder / "provisions.json", change)
    rehash(folder)
    with pytest.raises(PackError, match=message):
        load(folder)


def test_what_is_replaced_is_not_inherited_and_inherited_signs_name_its_successor(copy_pack: Copy) -> None:
    copy_pack("DEU-v1")
    folder = copy_pack("DEU-v1-VSL")
    stop = load(folder).signs["stop"].provisions[0]
    edit(folder / "provisions.json", lambda p: p[0].update(replaces=[stop]))
    rehash(folder)
    pack = load(folder)
    own = json.loads((folder / "provisions.json").read_text("utf-8"))[0]["id"]
    assert own in pack.signs["stop"].provisions
    assert stop not in pack.provisions
    assert stop not in pack.origin
    assert not any(
        stop in sign.provisions for code, sign in pack.signs.items() if pack.origin[f"sign:{code}"] != pack.version
    )


def test_packs_that_extend_each_other_are_refused(copy_pack: Copy) -> None:
    parent, child = copy_pack("DEU-v1"), copy_pack("DEU-v1-VSL")
    edit(parent / "manifest.json", lambda m: m.update(extends={"id": "DEU-v1-VSL", "version": "1.0.0"}))
    rehash(parent)
    with pytest.raises(PackError, match="circle"):
        load(child)


def test_a_broken_pack_keeps_no_other_from_loading(copy_pack: Copy) -> None:
    broken = copy_pack("GBR-v1")
    (broken / "signs.json").unlink()
    book, refused = load_book([broken, data("rulepacks/DEU-v1")])
    assert list(book.packs) == ["DEU-v1"]
    assert len(refused) == 1
    assert "signs.json" in refused[0]
