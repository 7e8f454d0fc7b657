"""The numbers of an ordered list that stand in attributes are written before its items."""

from pathlib import Path

import pytest

from services.rules.authoring.statutes.drafts import read_statute

CLML = (
    '<Legislation xmlns="http://www.legislation.gov.uk/namespaces/legislation" xmlns:dc="http://purl.org/dc/elements/1.1/">'
    "<Metadata><dc:title>Road Act</dc:title></Metadata><Primary><Body><P1 id='section-1'><Pnumber>1</Pnumber><P1para>"
    "<Text>A driver must—</Text>{}</P1para></P1></Body></Primary></Legislation>"
)
AKN = (
    '<akomaNtoso xmlns="http://docs.oasis-open.org/legaldocml/ns/akn/3.0"><act><preface><docTitle>Road Act</docTitle></preface><body>'
    "<section><num>1</num><content><p>A driver must—</p>{}</content></section></body></act></akomaNtoso>"
)


def text_of(tmp_path: Path, law: str) -> str:
    (tmp_path / "act.xml").write_text(law, encoding="utf-8")
    statute = read_statute(tmp_path / "act.xml")
    assert statute.left == ()
    (section,) = statute.sections
    return section.text.removeprefix("A driver must— ")


def ordered(attributes: str, *items: str) -> str:
    inside = "".join(f"<ListItem><Para><Text>{item}</Text></Para></ListItem>" for item in items)
    return f"<OrderedList {attributes}>{inside}</OrderedList>"


@pytest.mark.parametrize(
    ("attributes", "read_as"),
    [
        ('Type="alpha" Decoration="parens"', "(a) stop, (b) wait."),
        ('Type="alphaupper" Decoration="parenRight"', "A) stop, B) wait."),
        ('Type="roman" Decoration="brackets"', "[i] stop, [ii] wait."),
        ('Type="romanupper" Decoration="bracketRight"', "I] stop, II] wait."),
        ('Type="arabic" Decoration="colon"', "1: stop, 2: wait."),
        ('Type="arabic" Decoration="none"', "1 stop, 2 wait."),
        ("", "1. stop, 2. wait."),
    ],
)
def test_a_british_list_writes_its_numbers_as_it_says(attributes: str, read_as: str, tmp_path: Path) -> None:
    assert text_of(tmp_path, CLML.format(ordered(attributes, "stop,", "wait."))) == read_as


def test_a_number_of_an_items_own_is_written_instead(tmp_path: Path) -> None:
    listed = ordered('Type="alpha" Decoration="parens"', "stop,", "look,", "wait.")
    listed = listed.replace("<ListItem>", '<ListItem NumberOverride="za">', 1)
    listed = "<ListItem NumberOverride='(bb)'>".join(listed.rsplit("<ListItem>", 1))
    assert text_of(tmp_path, CLML.format(listed)) == "(za) stop, (b) look, (bb) wait."


def test_lists_in_lists_count_on_their_own(tmp_path: Path) -> None:
    inner = ordered('Type="roman" Decoration="parens"', *["x"] * 9)
    outer = ordered('Type="alpha" Decoration="parens"', f"do</Text>{inner}<Text>all,", "wait.")
    inside = " ".join(f"({each}) x" for each in ("i", "ii", "iii", "iv", "v", "vi", "vii", "viii", "ix"))
    assert text_of(tmp_path, CLML.format(outer)) == f"(a) do {inside} all, (b) wait."


def test_letters_go_on_doubled_and_a_list_beyond_all_measure_in_figures(tmp_path: Path) -> None:
    said = text_of(tmp_path, CLML.format(ordered('Type="alpha" Decoration="parens"', *["x"] * 401)))
    assert "(z) x (aa) x (bb) x" in said
    assert said.endswith("(401) x")


@pytest.mark.parametrize(
    ("listed", "read_as"),
    [
        ('<ol type="a"><li>stop,</li><li>wait.</li></ol>', "a. stop, b. wait."),
        ('<ol start="3"><li>stop,</li><li value="7">wait,</li><li>go.</li></ol>', "3. stop, 7. wait, 8. go."),
        ("<ol><li><b>1.</b> stop,</li><li>2. wait.</li></ol>", "1. stop, 2. wait."),
        ('<ol start="x"><li>stop.</li></ol>', "1. stop."),
        ("<ul><li>stop,</li><li>wait.</li></ul>", "stop, wait."),
    ],
)
def test_a_list_of_akoma_ntoso_is_numbered_once(listed: str, read_as: str, tmp_path: Path) -> None:
    assert text_of(tmp_path, AKN.format(listed)) == read_as
