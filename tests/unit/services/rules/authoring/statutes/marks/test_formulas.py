"""A formula of a statute stands on one line that can be read, or is told as not read, with its place."""

from pathlib import Path

import pytest

from services.rules.authoring.statutes.drafts import read_statute
from services.rules.authoring.statutes.marks.formulas import MAX_DEPTH
from services.rules.authoring.statutes.statute import Statute

AKN = (
    '<akomaNtoso xmlns="http://docs.oasis-open.org/legaldocml/ns/akn/3.0"><act><preface><docTitle>Road Act</docTitle></preface><body>'
    "<section><num>1</num><content><p>Stop after {} m.</p></content></section></body></act></akomaNtoso>"
)
CLML = (
    '<Legislation xmlns="http://www.legislation.gov.uk/namespaces/legislation" xmlns:dc="http://purl.org/dc/elements/1.1/">'
    "<Metadata><dc:title>Road Act</dc:title></Metadata><Primary><Body><P1 id='section-1'><Pnumber>1</Pnumber><P1para><Text>"
    "Stop after <Formula>{}</Formula> m.</Text></P1para></P1></Body></Primary></Legislation>"
)
GII = (
    "<dokumente><norm><metadaten><amtabk>Road Act</amtabk><enbez>s. 1</enbez></metadaten><textdaten><text><Content>"
    "<P>Stop after {} m.</P></Content></text></textdaten></norm></dokumente>"
)
V, TEN, POWER = "<mi>v</mi>", "<mn>10</mn>", "<msup><mi>v</mi><mn>2</mn></msup>"
BY_TEN = f"<mfrac>{V}{TEN}</mfrac>"


def math(inside: str) -> str:
    return f'<m:math xmlns:m="http://www.w3.org/1998/Math/MathML">{inside.replace("<", "<m:").replace("<m:/", "</m:")}</m:math>'


def read(tmp_path: Path, text: str) -> Statute:
    (tmp_path / "act.xml").write_text(text, encoding="utf-8")
    return read_statute(tmp_path / "act.xml")


@pytest.mark.parametrize("form", [AKN, CLML, GII])
def test_a_formula_of_each_publisher_stands_on_one_line_and_is_told_with_its_place(form: str, tmp_path: Path) -> None:
    statute = read(tmp_path, form.format(math(f"<mfrac>{POWER}<mn>20</mn></mfrac>")))
    assert [each.text for each in statute.sections] == ["Stop after (v^2)/20 m."]
    (told,) = statute.left
    assert told == "formulas on one line, to be checked with the official text: Road Act s. 1 '(v^2)/20'"


@pytest.mark.parametrize(
    ("written", "read_as"),
    [
        (f"{BY_TEN}<mo>+</mo><msup><mrow><mo>(</mo>{BY_TEN}<mo>)</mo></mrow><mn>2</mn></msup>", "v/10 + (v/10)^2"),
        (f"<mfrac><mn>1</mn><mn>2</mn></mfrac>{V}", "(1/2) v"),
        (f"{TEN}<mfrac><mn>1</mn><mn>2</mn></mfrac>", "10 (1/2)"),
        (f"{V}<mo>÷</mo>{BY_TEN}", "v ÷ (v/10)"),
        ("<mfenced>" * 30 + V + "</mfenced>" * 30, "(" * 30 + "v" + ")" * 30),
        (f"<msup><mrow><mn>2</mn>{V}</mrow><mn>2</mn></msup>", "(2 v)^2"),
        (f"<msup>{POWER}<mn>3</mn></msup>", "(v^2)^3"),
        (f"<msup>{TEN}<mrow><mo>−</mo><mn>3</mn></mrow></msup>", "10^(− 3)"),
        ("<msubsup><mi>v</mi><mi>max</mi><mn>2</mn></msubsup>", "v_max^2"),
        (f"<msqrt>{V}<mo>+</mo>{TEN}</msqrt>", "√(v + 10)"),
        (f"<mfrac><mfenced>{V}{TEN}</mfenced><mn>2</mn></mfrac>", "(v, 10)/2"),
        (f"{TEN}<mo>\u2062</mo>{V}", "10 · v"),
        (f"<semantics><mrow>{BY_TEN}</mrow><annotation>v over ten</annotation></semantics>", "v/10"),
        ("<mfrac><mtext>speed in km/h</mtext><mn>2</mn></mfrac>", "(speed in km/h)/2"),
    ],
)
def test_what_a_formula_joins_stays_joined(written: str, read_as: str, tmp_path: Path) -> None:
    statute = read(tmp_path, AKN.format(math(written)))
    assert [each.text for each in statute.sections] == [f"Stop after {read_as} m."]


@pytest.mark.parametrize(
    "written",
    [
        "<mtable><mtr><mtd><mi>v</mi></mtd></mtr></mtable>",
        f"<mover>{V}<mo>¯</mo></mover>",
        "<apply><plus/><ci>v</ci></apply>",
        f"<mfrac>{V}</mfrac>",
        f'<mfrac linethickness="0">{V}{TEN}</mfrac>',
        "<mrow>" * MAX_DEPTH + V + "</mrow>" * MAX_DEPTH,
        "<mrow>" * 50_000 + V + "</mrow>" * 50_000,
    ],
    ids=["table", "mark", "content", "part missing", "no fraction", "deep", "very deep"],
)
def test_a_formula_without_a_form_on_one_line_is_told_as_not_read(written: str, tmp_path: Path) -> None:
    statute = read(tmp_path, AKN.format(math(written)))
    assert [each.text for each in statute.sections] == ["Stop after (formula) m."]
    assert statute.left == ("formulas, not read: Road Act s. 1",)


def test_a_formula_of_one_word_is_read_untold(tmp_path: Path) -> None:
    statute = read(tmp_path, AKN.format(math(V)))
    assert [each.text for each in statute.sections] == ["Stop after v m."]
    assert statute.left == ()
