"""The check of language: what it finds, what it lets pass, and that the repository passes."""

import tomllib
from pathlib import Path

import pytest

from scripts.prose import __main__ as prose
from scripts.prose.rules import MOST_WORDS, Finding, findings
from scripts.prose.text import Sentence, of_code, of_page


@pytest.mark.parametrize(
    ("text", "rule"),
    [
        ("Nobody is told.", "words"),
        ("A rider is none on foot.", "words"),
        ("Signs are not told apart by it.", "words"),
        ("Who rides is not on foot as well.", "who"),
        ("one " * (MOST_WORDS + 1), "length"),
        ("The QZX decides.", "names"),
    ],
)
def test_a_sentence_that_breaks_a_rule_is_found(text: str, rule: str) -> None:
    assert [each.rule for each in findings(Sentence(1, text.strip()))] == [rule]


@pytest.mark.parametrize(
    "text",
    [
        "A rider is not also a pedestrian.",
        "Who may call it?",
        "`nobody` is a user of Unix.",
        "RSS gives the distance.",
        "one " * MOST_WORDS,
    ],
)
def test_plain_sentences_pass(text: str) -> None:
    assert list(findings(Sentence(1, text.strip()))) == []


def test_sentences_of_a_page_leave_out_code_and_read_links_as_their_text() -> None:
    page = "# Title\n\nOne `x`. Two\n[link](a.md) goes on.\n\n```sh\nnobody\n```\n- item\n\n| a | b |\n"
    assert list(of_page(page)) == [
        Sentence(1, "Title"),
        Sentence(3, "One `code`."),
        Sentence(3, "Two link goes on."),
        Sentence(9, "item"),
        Sentence(11, "a"),
        Sentence(11, "b"),
    ]


def test_docstrings_of_fields_are_read_and_other_strings_are_not() -> None:
    code = '"""Of the module."""\nX = "nobody"\nclass A:\n    y: int\n    """Of the field."""\n'
    assert {each.text for each in of_code(code)} == {"Of the module.", "Of the field."}


def test_the_repository_breaks_no_rule_beyond_what_is_allowed(capsys: pytest.CaptureFixture[str]) -> None:
    assert prose.main([]) == 0, capsys.readouterr().out


def test_a_new_finding_and_an_allowance_that_is_too_high_are_both_named() -> None:
    page = prose.ROOT / "README.md"
    found = {page: [Finding(3, "words", "no")]}
    assert prose.problems(found, {"README.md": {"words": 1}}) == []
    assert prose.problems(found, {}) == ["README.md:3: words: no"]
    (line,) = prose.problems(found, {"README.md": {"words": 2}})
    assert "1 are left, 2 allowed" in line
    assert "is gone" in prose.problems(found, {"README.md": {"words": 1}, "gone.md": {"words": 1}})[0]


def test_what_is_allowed_only_falls(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = tmp_path / "allowed.toml"
    file.write_text(prose.as_toml({"README.md": {"words": 1, "length": 5}}), encoding="utf-8")
    monkeypatch.setattr(prose, "ALLOWED", file)
    finding = Finding(1, "words", "no")
    monkeypatch.setattr(prose, "check", lambda files: {prose.ROOT / "README.md": [finding, finding]})
    assert prose.main(["--allow"]) == 0
    assert tomllib.loads(file.read_text(encoding="utf-8")) == {"README.md": {"words": 1}}


def test_words_by_hand_are_counted_without_generated_pages(capsys: pytest.CaptureFixture[str]) -> None:
    assert prose.main(["--count"]) == 0
    assert int(capsys.readouterr().out.split()[0]) == prose.count() > 1000
    names = {path.name for path in prose.pages()}
    assert "architecture.md" in names
    assert not {"topics.md", "results.md", "CHANGELOG.md"} & names


@pytest.mark.parametrize(
    "hidden",
    [
        "````md\n```sh\nWho runs it\n```\nWho is inside?\n````",
        "~~~\n```\nWho runs it\n~~~",
        "<!-- one\nWho comments\n-->",
        "```sh\r\nWho runs it\r\n```",
    ],
)
def test_code_within_fences_of_any_length_and_comments_are_no_sentences(hidden: str) -> None:
    assert [each.text for each in of_page(f"Before.\n\n{hidden}\n\nAfter.\n")] == ["Before.", "After."]


def test_an_indented_table_is_read_cell_by_cell() -> None:
    assert [each.text for each in of_page("  | a | b |\n")] == ["a", "b"]
