"""`drivemcp rulepack` as its users see it."""

import json
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.cli import run
from drivemcp.paths import data
from services.retrieval.corpus import CorpusError, read_pack
from services.rules.book import load_book
from services.rules.packs.loading import load
from tests.unit.services.rules.editing import adopted, edit, rehash, set_limit

Said = pytest.CaptureFixture[str]


def rulepack(*arguments: object) -> int:
    return run(["rulepack", *map(str, arguments)])


def test_a_new_pack_is_drafts_alone_and_no_service_loads_it(tmp_path: Path, capsys: Said) -> None:
    folder = tmp_path / "ITA-v1"
    assert rulepack("new", folder, "--jurisdiction", "ITA", "--title", "Italy") == 0
    assert "drafts" in capsys.readouterr().out
    assert rulepack("validate", folder) == 1
    told = capsys.readouterr().out.splitlines()
    entries = [entry for name in ("provisions", "signs") for entry in json.loads((folder / f"{name}.json").read_text())]
    assert len(told) == len(entries) > 60
    assert all("is a draft" in line for line in told)
    book, refused = load_book([folder])
    assert not book.packs
    assert "is a draft" in refused[0]
    with pytest.raises(CorpusError, match="is a draft"):
        read_pack(folder)


def test_a_pack_whose_drafts_are_taken_for_law_is_right_and_passes_its_cases(tmp_path: Path, capsys: Said) -> None:
    folder = tmp_path / "ITA-v1"
    adopted(folder, "ITA")
    assert rulepack("validate", folder) == 0
    assert rulepack("test", folder) == 0
    assert "76 of 76 cases hold" in capsys.readouterr().out
    pack = load(folder)
    assert pack.manifest.jurisdiction == "ITA"
    assert "ita-speed-town" in pack.provisions
    assert not [name for name in pack.provisions if name.startswith("test-")]


def test_a_new_pack_may_extend_another_across_regions_and_nations(tmp_path: Path) -> None:
    region, nation = tmp_path / "ZZZ-N-v1", tmp_path / "SMR-v1"
    assert rulepack("new", region, "--extends", "TEST-v1", "--jurisdiction", "ZZZ-N") == 0
    assert rulepack("new", nation, "--extends", "TEST-v1", "--jurisdiction", "SMR") == 0
    for folder in (region, nation):
        assert rulepack("validate", folder) == 0
        assert "test-speed-town" in load(folder).provisions


@pytest.mark.parametrize(
    "arguments", [["x/Not A Name"], ["ITA-v2", "--jurisdiction", "it"], ["A-v1", "--extends", "NO-v9"]]
)
def test_a_new_pack_needs_a_name_a_country_and_a_parent_that_is_there(
    arguments: list[str], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    assert rulepack("new", *arguments) == 1
    assert not list(tmp_path.iterdir())


def test_nothing_is_overwritten_by_a_new_pack(pack: Path) -> None:
    assert rulepack("new", pack) == 1


def test_every_mistake_is_told_with_file_line_and_field(pack: Path, capsys: Said) -> None:
    edit(pack / "provisions.json", lambda p: p[2]["effects"][0].update(value="fast"))
    edit(pack / "provisions.json", lambda p: p[4].update(kind="rumour"))
    edit(pack / "signs.json", lambda s: s[1].update(provisions=["ita-nowhere"], action="fly"))
    edit(pack / "signs.json", lambda s: s[3]["sources"][1].update(start=7))
    edit(pack / "manifest.json", lambda m: m.update(effective_until="2001-01-01"))
    edit(pack / "cases.json", lambda c: c[0]["ask"].update(visibilty_m=3))
    edit(pack / "cases.json", lambda c: c[1]["expect"].update(limt=[3, "km/h"]))
    assert rulepack("validate", pack) == 1
    told = capsys.readouterr().out.splitlines()
    wanted = {
        "provisions.json": ("[2].effects[0].value", "[4].kind"),
        "signs.json": ("[1].action", "[3].sources[1]"),
        "manifest.json": ("effective_until",),
        "cases.json": ("[0].ask.visibilty_m", "[1].expect.limt"),
    }
    for file, fields in wanted.items():
        lines = (pack / file).read_text(encoding="utf-8").splitlines()
        for field in fields:
            (line,) = [line for line in told if f"{file}:" in line and f": {field}" in line]
            number = int(line.split(f"{file}:")[1].split(":")[0])
            last = field.rpartition(".")[2].rpartition("[")
            assert (f'"{field.rpartition(".")[2]}"' in lines[number - 1]) or last[1], line


def test_what_is_no_json_is_told_with_its_line(pack: Path, capsys: Said) -> None:
    (pack / "signs.json").write_text('[\n {"code": "limit"},\n {"code": }\n]', encoding="utf-8")
    assert rulepack("validate", pack) == 1
    assert f"{pack / 'signs.json'}:3: JSON is malformed" in capsys.readouterr().out


def test_texts_that_nothing_refers_to_are_told(pack: Path, capsys: Said) -> None:
    path = pack / "sources" / "law.en.md"
    path.write_text(
        path.read_text(encoding="utf-8") + "\n## Act § 99 [ita-lost]\n\nNobody reads this.\n", encoding="utf-8"
    )
    assert rulepack("seal", pack) == 0
    assert rulepack("validate", pack) == 1
    assert "nothing is called [ita-lost]" in capsys.readouterr().out


def test_after_an_edit_seal_finds_the_offsets_again(pack: Path, capsys: Said) -> None:
    path = pack / "sources" / "law.en.md"
    text = path.read_text(encoding="utf-8").replace("faster than 50 km/h", "faster than fifty")
    path.write_text(text.replace("# The law", "# The whole law"), encoding="utf-8")
    assert rulepack("validate", pack) == 1
    assert rulepack("seal", pack) == 0
    assert rulepack("validate", pack) == 0
    assert rulepack("hash", pack) == 0
    assert load(pack).manifest.content_sha256 in capsys.readouterr().out
    assert load(pack).provisions["ita-speed-town"].sources[0].excerpt.endswith("faster than fifty.")


@pytest.mark.parametrize("content", ["[{}]", "{}", "[3]", '[{"id": "x", "sources": [3]}]', "nonsense"])
def test_what_cannot_be_sealed_is_told(content: str, pack: Path, capsys: Said) -> None:
    (pack / "provisions.json").write_text(content, encoding="utf-8")
    assert rulepack("seal", pack) == 1
    assert str(pack) in capsys.readouterr().err


def test_a_case_that_does_not_hold_is_told_and_the_status_is_one(pack: Path, capsys: Said) -> None:
    set_limit(pack, "ita-speed-town", 45)
    assert rulepack("test", pack, "TEST-v1") == 1
    out = capsys.readouterr().out
    assert "urban, car: limit: expected [50, 'km/h'], got [45.0, 'km/h']" in out
    assert "TEST-v1@" in out


def test_a_broken_pack_fails_its_test_and_keeps_no_other_from_being_tested(pack: Path, capsys: Said) -> None:
    (pack / "signs.json").unlink()
    assert rulepack("test", pack, "TEST-v1") == 1
    assert "76 of 76" in capsys.readouterr().out


def test_show_lists_a_pack_and_shows_one_entry_with_text_and_offsets(capsys: Said) -> None:
    assert rulepack("show", "TEST-v1") == 0
    listed = capsys.readouterr().out
    assert "test-speed-town" in listed
    assert "plate:when_wet" in listed
    assert rulepack("show", "TEST-v1", "test-speed-fog") == 0
    said = capsys.readouterr().out
    assert "limit, whatever a sign shows, 50 km/h with less than 50 m of sight" in said
    source = load(data("rulepacks/TEST-v1")).provisions["test-speed-fog"].sources[1]
    assert source.excerpt in said
    assert f"characters {source.start} to {source.end}" in said
    assert rulepack("show", "TEST-v1", "stop") == 0
    assert "the driver must: stop" in capsys.readouterr().out
    assert rulepack("show", "TEST-v1", "nonsense") == 1


def test_diff_says_what_changed_for_a_driver(pack: Path, tmp_path: Path, capsys: Said) -> None:
    other = tmp_path / "later" / "ITA-v1"
    adopted(other, "ITA")
    assert rulepack("diff", pack, other) == 0
    assert capsys.readouterr().out == "nothing changed\n"
    set_limit(other, "ita-speed-town", 30)
    set_limit(other, "ita-speed-open-road", 100)

    def change(provisions: list[dict[str, Any]]) -> None:
        by_id = {p["id"]: p for p in provisions}
        by_id["ita-overtaking"]["effects"] = [{"type": "duty", "what": "wait", "action": "yield"}]

    edit(other / "provisions.json", change)
    edit(other / "signs.json", lambda s: s[0]["values"].append(130.0) or s[8].update(action="yield"))
    edit(other / "signs.json", lambda s: [entry for entry in s if entry["code"] != "slippery"])
    path = other / "sources" / "law.de.md"
    path.write_text(path.read_text(encoding="utf-8").replace("Mit Schneeketten", "Mit Ketten"), encoding="utf-8")
    for name in ("signs.en.md", "signs.de.md", "signs.fr.md"):
        path = other / "sources" / name
        text = path.read_text(encoding="utf-8")
        path.write_text(text.replace("[sign:slippery]", "[sign:gone]"), encoding="utf-8")
    assert rulepack("seal", other) == 0
    capsys.readouterr()
    assert rulepack("diff", pack, other) == 0
    said = capsys.readouterr().out
    for line in (
        "lowered from 50 km/h: limit 30 km/h in built-up areas [ita-speed-town]",
        "RAISED from 90 km/h: limit 100 km/h outside built-up areas [ita-speed-open-road]",
        "gone: forbidden: overtaking (sign no_overtaking) [ita-overtaking]",
        "new: duty: wait (yield) [ita-overtaking]",
        "stop (T 9): action: stop is now yield",
        "gone: slippery (T 15): Slippery road.",
        "reworded: ita-speed-chains (Test Act § 2 (4)), de",
    ):
        assert line in said, said


def test_diff_tells_what_may_raise_a_limit_without_changing_one(pack: Path, tmp_path: Path, capsys: Said) -> None:
    other = tmp_path / "later" / "ITA-v1"
    adopted(other, "ITA")

    def change(provisions: list[dict[str, Any]]) -> None:
        by_id = {p["id"]: p for p in provisions}
        by_id["ita-speed-town"]["kind"] = "guidance"
        by_id["ita-temporary-first"]["effects"] = [{"type": "duty", "what": "care", "action": "proceed_with_care"}]
        by_id["ita-speed-calm"]["effects"][0]["when"].pop("announced")

    edit(other / "provisions.json", change)
    edit(other / "signs.json", lambda s: s[0].pop("effect") and None)
    rehash(other)
    capsys.readouterr()
    assert rulepack("diff", pack, other) == 0
    said = capsys.readouterr().out
    for line in (
        "statute is now guidance, so that OTHER LIMITS MAY HOLD: ita-speed-town (Test Act § 1 (1))",
        "gone: how signs are read: temporary over permanent [ita-temporary-first]",
        "gone: limit, whatever a sign shows, 20 km/h in living streets, only from the road's own sign on [ita-speed-calm], "
        "so that OTHER LIMITS MAY HOLD",
        "limit (T 1-{value}): effect: limit is now nothing, so that OTHER LIMITS MAY HOLD",
        "new: limit, whatever a sign shows, 20 km/h in living streets [ita-speed-calm]",
    ):
        assert line in said, said


@pytest.fixture
def key(tmp_path: Path, capsys: Said) -> tuple[Path, str]:
    path = tmp_path / "key"
    assert run(["grant", "--make-key", str(path)]) == 0
    return path, capsys.readouterr().out.strip()


def test_a_signed_pack_satisfies_who_demands_that_key_and_nobody_else(
    pack: Path, key: tuple[Path, str], tmp_path: Path, capsys: Said
) -> None:
    path, public = key
    assert rulepack("validate", pack, "--key", public) == 1
    assert "a signature is required" in capsys.readouterr().out
    assert rulepack("sign", pack, "--key", path) == 0
    assert rulepack("validate", pack, "--key", public) == 0
    assert run(["grant", "--make-key", str(tmp_path / "other")]) == 0
    other = capsys.readouterr().out.split()[-1]
    assert rulepack("validate", pack, "--key", other) == 1
    assert "not trusted" in capsys.readouterr().out


def test_a_pack_that_was_changed_after_signing_is_refused_even_if_sealed(
    pack: Path, key: tuple[Path, str], capsys: Said
) -> None:
    assert rulepack("sign", pack, "--key", key[0]) == 0
    assert rulepack("seal", pack) == 0
    assert "removed" not in capsys.readouterr().out, "the same content keeps its signature"
    set_limit(pack, "ita-speed-town", 100)
    assert rulepack("validate", pack) == 1
    assert rulepack("seal", pack) == 0
    rehash(pack)
    assert rulepack("validate", pack, "--key", key[1]) == 1


def test_sealing_a_changed_pack_says_that_its_signature_is_gone(
    pack: Path, key: tuple[Path, str], capsys: Said
) -> None:
    assert rulepack("sign", pack, "--key", key[0]) == 0
    set_limit(pack, "ita-speed-town", 40, sealed=False)
    assert rulepack("seal", pack) == 0
    assert f"{pack / 'signature.json'} signed another content and is removed" in capsys.readouterr().out
    assert not (pack / "signature.json").exists()


def test_an_unsealed_pack_is_not_signed_and_a_bad_key_is_told(
    pack: Path, key: tuple[Path, str], tmp_path: Path
) -> None:
    (tmp_path / "bad").write_text("no key", encoding="ascii")
    assert rulepack("sign", pack, "--key", tmp_path / "bad") == 1
    assert rulepack("sign", pack, "--key", tmp_path / "absent") == 2
    set_limit(pack, "ita-speed-town", 100, sealed=False)
    assert rulepack("sign", pack, "--key", key[0]) == 1


@given(
    field=st.sampled_from(["pack_id", "version", "content_sha256", "public_key", "signature"]), at=st.integers(0, 200)
)
def test_no_altered_signature_holds(field: str, at: int) -> None:
    from tempfile import TemporaryDirectory

    from drivemcp.runtime.grants import make_key
    from services.rules.authoring.scaffold import scaffold
    from services.rules.packs.loading import examine
    from services.rules.packs.signature import Trust, sign

    with TemporaryDirectory() as name:
        folder, pair = Path(name) / "A-v1", make_key()
        scaffold(folder, extends="TEST-v1")
        made = sign(folder, pair.private)
        text = getattr(made, field)
        at %= len(text)
        changed = text[:at] + ("1" if text[at] != "1" else "2") + text[at + 1 :]
        edit(folder / "signature.json", lambda s: s.update({field: changed}))
        assert examine(folder, Trust(keys=(pair.public, changed), required=False))[0] is None


def test_a_parent_must_be_signed_too(tmp_path: Path, key: tuple[Path, str], capsys: Said) -> None:
    adopted(tmp_path / "ITA-v1", "ITA")
    folder = tmp_path / "ITA-R"
    assert rulepack("new", folder, "--extends", "ITA-v1") == 0
    assert rulepack("sign", folder, "--key", key[0]) == 0
    assert rulepack("validate", folder, "--key", key[1]) == 1
    assert f"{tmp_path / 'ITA-v1' / 'signature.json'}: a signature is required" in capsys.readouterr().out
    assert rulepack("sign", tmp_path / "ITA-v1", "--key", key[0]) == 0
    assert rulepack("validate", folder, "--key", key[1]) == 0


def test_json_of_a_new_pack_is_what_people_can_edit(pack: Path) -> None:
    assert len((pack / "provisions.json").read_text(encoding="utf-8").splitlines()) > 100
    assert json.loads((pack / "manifest.json").read_text(encoding="utf-8"))["id"] == "ITA-v1"


def test_every_command_that_the_docs_name_is_there(capsys: Said) -> None:
    import re

    pages = [data("rulepacks") / "README.md", Path(__file__).parents[5] / "docs" / "how-to" / "rulepacks.md"]
    named = {
        name for page in pages for name in re.findall(r"drivemcp rulepack (\w+)", page.read_text(encoding="utf-8"))
    }
    assert named == {"new", "import", "seal", "validate", "test", "show", "diff", "hash", "sign"}
    for name in named:
        with pytest.raises(SystemExit) as ended:
            rulepack(name, "--help")
        assert ended.value.code == 0


@pytest.mark.parametrize("command", ["validate", "hash", "seal", "test", "show", "sign", "diff"])
def test_a_pack_that_is_nowhere_is_a_wrong_command(
    command: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "key").touch()
    more = {"sign": ["--key", "key"], "diff": ["DEU-v1"]}.get(command, [])
    assert rulepack(command, "nowhere", *more) == 2
    assert "no pack 'nowhere'" in capsys.readouterr().err
