"""The page of two versions side by side."""

import re
from html.parser import HTMLParser
from pathlib import Path

import pytest

from drivemcp.cli import run
from services.rules.authoring.diff_page import page
from services.rules.authoring.seal import seal
from services.rules.packs.loading import load
from tests.unit.services.rules.editing import adopted, edit, set_limit

EVIL = '<script>alert(1)</script><img src="http://evil.example/x"> & \u202eevil'

TAGS = set(
    re.findall(r"\w+", "html head meta title style body h1 h2 h3 p ul li div table thead tbody tr th td del ins mark")
)


class Read(HTMLParser):
    """Tags, attributes and the text inside each kind of tag."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.tags: list[str] = []
        self.attributes: list[tuple[str, str | None]] = []
        self.inside: dict[str, list[str]] = {}
        self._open: list[str] = []
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.attributes += attrs
        if tag != "meta":
            self._open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self._open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self._open:
            self.inside.setdefault(self._open[-1], []).append(data)


@pytest.fixture
def later(pack: Path, tmp_path: Path) -> Path:
    folder = tmp_path / "later" / "ITA-v1"
    adopted(folder, "ITA")
    return folder


def test_texts_and_demands_stand_side_by_side_with_changed_words_marked(pack: Path, later: Path) -> None:
    set_limit(later, "ita-speed-town", 60)
    path = later / "sources" / "law.en.md"
    path.write_text(
        path.read_text(encoding="utf-8").replace("faster than 50 km/h", "faster than 60 km/h", 1), encoding="utf-8"
    )
    edit(later / "signs.json", lambda s: s[8].update(action="yield"))
    seal(later)
    read = Read(page(load(pack), load(later)))
    assert read.inside["del"] == ["50", "50", "stop"]
    assert read.inside["ins"] == ["60", "60", "yield"]
    assert "limit 60 km/h in built-up areas" not in read.inside["td"], "the number is in its own mark"
    assert any("RAISED from 50 km/h" in line for line in read.inside["li"])
    assert ("class", "warned") in read.attributes
    assert any("Test Act § 1 (1)\nita-speed-town" in head for head in read.inside["th"])


def test_what_is_new_or_gone_is_named_so(pack: Path, later: Path) -> None:
    edit(later / "provisions.json", lambda p: [entry for entry in p if entry["id"] != "ita-guide-gap"])
    edit(later / "signs.json", lambda s: s.append(s[8] | {"code": "other:sledges"}))
    for name in ("signs.en.md", "signs.de.md", "signs.fr.md"):
        path = later / "sources" / name
        path.write_text(
            f"{path.read_text(encoding='utf-8')}\n## T 99 [sign:other:sledges]\n\nSledges.\n", encoding="utf-8"
        )
    seal(later)
    read = Read(page(load(pack), load(later)))
    assert read.inside["mark"] == ["gone", "new"]
    assert "Sledges." in read.inside["td"]


def test_whatever_a_pack_says_stands_there_as_text_and_nothing_is_fetched(pack: Path, later: Path) -> None:
    edit(later / "manifest.json", lambda m: m.update(title=EVIL, disclaimer=EVIL))
    edit(later / "signs.json", lambda s: s[8]["meaning"].update(en=EVIL) or s[8].update(national=EVIL))
    edit(later / "provisions.json", lambda p: p[0].update(url="javascript:alert(1)"))
    seal(later)
    told = page(load(pack), load(later))
    read = Read(told)
    assert set(read.tags) <= TAGS
    assert {name for name, _ in read.attributes} <= {
        "lang",
        "charset",
        "name",
        "content",
        "http-equiv",
        "class",
        "scope",
    }
    assert "default-src 'none'" in told
    assert "url(" not in "".join(read.inside["style"])
    assert "\u202e" not in told
    assert "[U+202E]" in told


def test_packs_that_are_alike_are_said_to_be(pack: Path, later: Path) -> None:
    read = Read(page(load(pack), load(later)))
    assert "Nothing changes for a driver." in read.inside["p"]
    assert read.inside["p"].count("Unchanged.") == 3
    assert not {"del", "ins"} & set(read.tags)


def test_the_command_writes_the_page(
    pack: Path, later: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    file = tmp_path / "diff.html"
    assert run(["rulepack", "diff", str(pack), str(later), "--html", str(file)]) == 0
    assert file.read_text(encoding="utf-8") == page(load(pack), load(later))
    assert run(["rulepack", "diff", str(pack), str(later), "--html", str(tmp_path / "nowhere" / "x.html")]) == 2
    assert "cannot write" in capsys.readouterr().err
