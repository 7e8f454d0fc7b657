"""What is said around numbered parts stays, schedules are read, and what is left out of a statute is told."""

from pathlib import Path

import pytest

from drivemcp.cli import run
from services.rules.authoring.statutes.drafts import read_statute
from services.rules.authoring.statutes.statute import Statute

AKN = (
    '<akomaNtoso xmlns="http://docs.oasis-open.org/legaldocml/ns/akn/3.0"><act name="act"><meta>{meta}</meta>'
    "<preface><docTitle>Road Act</docTitle></preface><body>{body}</body>{after}</act></akomaNtoso>"
)
CLML = (
    '<Legislation xmlns="http://www.legislation.gov.uk/namespaces/legislation" xmlns:dc="http://purl.org/dc/elements/1.1/">'
    "<Metadata><dc:title>Road Act</dc:title></Metadata><Primary><Body>{body}</Body>{after}</Primary></Legislation>"
)
GII = "<dokumente><norm><metadaten><amtabk>StO</amtabk><langue>Ordnung</langue></metadaten></norm>{body}</dokumente>"
DATES = (
    '<lifecycle><eventRef eId="e1" date="{start}"/><eventRef eId="e2" date="{end}"/></lifecycle>'
    '<temporalData><temporalGroup eId="t1"><timeInterval start="#e1" end="#e2"/></temporalGroup></temporalData>'
)


def section(number: str, inside: str, attributes: str = "") -> str:
    return f"<section {attributes}><num>{number}.</num>{inside}</section>"


def said(text: str) -> str:
    return f"<content><p>{text}</p></content>"


def p1(number: str, inside: str, attributes: str = "") -> str:
    return f'<P1 id="section-{number}" {attributes}><Pnumber>{number}</Pnumber><P1para>{inside}</P1para></P1>'


def p2(number: str, text: str, attributes: str = "") -> str:
    return f"<P2 {attributes}><Pnumber>{number}</Pnumber><P2para><Text>{text}</Text></P2para></P2>"


def read(tmp_path: Path, text: str) -> Statute:
    (tmp_path / "act.xml").write_text(text, encoding="utf-8-sig")
    return read_statute(tmp_path / "act.xml")


def texts(statute: Statute) -> dict[str, str]:
    return {each.cited.removeprefix("Road Act "): each.text for each in statute.sections}


PARTS = (
    "<paragraph><num>(a)</num><content><p>60 in a town;</p></content></paragraph>"
    "<paragraph><num>(b)</num><content><p>100 elsewhere,</p></content></paragraph>"
)


def test_lead_in_and_tail_go_with_each_part(tmp_path: Path) -> None:
    body = section("5", f"<intro><p>At most</p></intro>{PARTS}<wrapUp><p>unless signed.</p></wrapUp>")
    statute = read(tmp_path, AKN.format(meta="", body=body, after=""))
    expected = {"s. 5(a)": "At most 60 in a town; unless signed.", "s. 5(b)": "At most 100 elsewhere, unless signed."}
    assert texts(statute) == expected
    assert statute.left == ()
    inside = f"<Text>At most</Text>{p2('a', '60 in a town;')}{p2('b', '100 elsewhere,')}<Text>unless signed.</Text>"
    statute = read(tmp_path, CLML.format(body=p1("5", inside), after=""))
    assert texts(statute) == expected
    assert statute.left == ()


SCHEDULES = {
    "paragraphs": (
        '<attachments><attachment><doc name="schedule"><mainBody><hcontainer name="schedule"><num>Schedule 1</num>'
        "<paragraph><num>1</num><content><p>Buses: 80.</p></content></paragraph></hcontainer></mainBody></doc></attachment></attachments>",
        {"Schedule 1 para. 1": "Buses: 80."},
    ),
    "text": (
        '<attachments><attachment><doc name="annex"><mainBody><p>Buses: 80.</p></mainBody></doc></attachment></attachments>',
        {"annex": "Buses: 80."},
    ),
    "table": (
        '<components><component><doc name="schedule"><mainBody><table><tr><td>Buses</td><td>80</td></tr></table></mainBody></doc>'
        "</component></components>",
        {"schedule": "Buses 80"},
    ),
    "table of paragraphs with a note": (
        '<components><component><doc name="schedule"><mainBody><table><tr><th>Kind</th></tr><tr><td><p>Buses</p></td>'
        "<td><p>80<authorialNote><p>Since 1999.</p></authorialNote></p></td></tr></table></mainBody></doc></component></components>",
        {"schedule": "Kind Buses 80"},
    ),
}


@pytest.mark.parametrize("kind", SCHEDULES)
def test_schedules_of_akoma_ntoso_are_read(tmp_path: Path, kind: str) -> None:
    after, expected = SCHEDULES[kind]
    statute = read(tmp_path, AKN.format(meta="", body=section("1", said("See the schedule.")), after=after))
    assert texts(statute) == {"s. 1": "See the schedule."} | expected
    assert statute.left == ()


def test_a_british_schedule_without_paragraphs_is_read(tmp_path: Path) -> None:
    after = "<Schedules><Schedule><Number>Schedule 3</Number><ScheduleBody><Text>Buses: 50.</Text></ScheduleBody></Schedule></Schedules>"
    statute = read(tmp_path, CLML.format(body=p1("1", "<Text>See it.</Text>"), after=after))
    assert texts(statute) == {"s. 1": "See it.", "Schedule 3": "Buses: 50."}


def test_a_british_schedule_keeps_what_stands_beside_its_numbered_paragraphs(tmp_path: Path) -> None:
    cells = "<tr><td>A</td><td>Bus</td><td>40</td></tr><tr><td>B</td><td>Coach</td><td>45</td></tr>"
    quoted = f"<Text>In the Other Act insert—</Text><BlockAmendment>{p1('9', '<Text>Quoted.</Text>')}</BlockAmendment>"
    paragraph = p1("1", "<Text>Part I is for cars.</Text>").replace("section-1", "schedule-6-part-II-paragraph-1")
    parts = (
        f"<Part><Number>Part I</Number><Title>Vehicles</Title><Tabular><table>{cells}</table></Tabular></Part>"
        f"<Part><Number>Part II</Number><P>{quoted}</P><P1group><Title>Use</Title>{paragraph}</P1group></Part>"
    )
    after = (
        "<Schedules><Schedule RestrictExtent='S'><Number>Schedule 6</Number><TitleBlock><Title>Limits</Title></TitleBlock>"
        f"<ScheduleBody>{parts}</ScheduleBody></Schedule></Schedules>"
    )
    statute = read(tmp_path, CLML.format(body=IN_FORCE, after=after))
    assert texts(statute) == {
        "s. 1": "Keep to 30.",
        "Schedule 6": "Part I A Bus 40 B Coach 45 In the Other Act insert— (9) Quoted.",
        "Sch. 6 para. 1": "Part I is for cars.",
    }
    assert [each.heading for each in statute.sections] == ["", "Limits", "Use"]
    assert statute.left == (
        "does not extend to England, drafted all the same: Schedule 6 (S), schedule-6-part-II-paragraph-1 (S)",
    )


@pytest.mark.parametrize("number", ["<Number>Part I</Number>", "<Text>. . . .</Text>"])
def test_a_british_schedule_of_numbered_paragraphs_alone_has_no_section_of_its_own(number: str, tmp_path: Path) -> None:
    after = f"<Schedules><Schedule><Number>Schedule 6</Number><Part>{number}{p1('2', '<Text>Stop.</Text>')}</Part></Schedule></Schedules>"
    statute = read(tmp_path, CLML.format(body=IN_FORCE, after=after))
    assert texts(statute) == {"s. 1": "Keep to 30.", "s. 2": "Stop."}
    assert statute.left == ()


IN_FORCE = p1("1", "<Text>Keep to 30.</Text>")


@pytest.mark.parametrize(
    "attributes",
    [
        'Status="Prospective"', 'Status="Repealed"', 'Status="Removed"', 'RestrictStartDate="2999-01-01"',
        'RestrictEndDate="1999-01-01"',
    ],
)  # fmt: skip
def test_what_a_british_act_marks_as_not_in_force_is_left_out_and_told(tmp_path: Path, attributes: str) -> None:
    gone = p1("2", "<Text>Any speed.</Text>", attributes)
    inside = p1("3", p2("1", "Stop.") + p2("2", "Go on.", attributes))
    group = f"<P1group {attributes}><Title>Old</Title>{p1('4', '<Text>A flag.</Text>')}</P1group>"
    statute = read(tmp_path, CLML.format(body=IN_FORCE + gone + inside + group, after=""))
    assert texts(statute) == {"s. 1": "Keep to 30.", "s. 3(1)": "Stop."}
    assert statute.left[0].startswith("not in force, left out: 3 parts: ")
    assert "Any speed." in " ".join(statute.left)


@pytest.mark.parametrize(
    "attributes", ['RestrictStartDate="1999-01-01"', 'RestrictEndDate="2999-01-01"', 'Status="Current"']
)
def test_what_a_british_act_has_in_force_stays(tmp_path: Path, attributes: str) -> None:
    statute = read(tmp_path, CLML.format(body=p1("2", "<Text>Keep left.</Text>", attributes), after=""))
    assert texts(statute) == {"s. 2": "Keep left."}
    assert statute.left == ()


@pytest.mark.parametrize(
    ("start", "end", "attributes", "stays"),
    [
        ("1990-01-01", "2999-01-01", 'period="#t1"', True),
        ("1990-01-01", "1999-01-01", 'period="#t1"', False),
        ("2999-01-01", "", 'period="#t1"', False),
        ("", "", 'status="removed"', False),
        ("", "", 'status="edited"', True),
    ],
)
def test_akoma_ntosos_status_and_period_count(
    tmp_path: Path, start: str, end: str, attributes: str, stays: bool
) -> None:
    body = section("1", said("Keep left.")) + section("2", said("Any speed."), attributes)
    statute = read(tmp_path, AKN.format(meta=DATES.format(start=start, end=end), body=body, after=""))
    assert ("s. 2" in texts(statute)) == stays
    assert ("Any speed." in " ".join(statute.left)) == (not stays)


def test_a_german_section_that_was_dropped_is_told(tmp_path: Path) -> None:
    norm = "<norm><metadaten><enbez>§ {n}</enbez></metadaten><textdaten><text><Content><P>{text}</P></Content></text></textdaten></norm>"
    body = norm.format(n=1, text="Rechts fahren.") + norm.format(n=2, text="(weggefallen)")
    statute = read(tmp_path, GII.format(body=body))
    assert [each.cited for each in statute.sections] == ["StO § 1"]
    assert statute.left == ("not in force, left out: StO § 2",)


def test_text_that_stands_in_no_section_is_told(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    body = (
        section("1", said("Keep left."))
        + "<hcontainer name='note'><content><p>Buses have rules of their own.</p></content></hcontainer>"
    )
    statute = read(tmp_path, AKN.format(meta="", body=body, after=""))
    assert statute.left == ("not read: 1 part: 'Buses have rules of their own.'",)
    assert run(["rulepack", "import", str(tmp_path / "act.xml"), "--out", str(tmp_path / "NEW-v1")]) == 0
    assert "not read: 1 part: 'Buses have rules of their own.'" in capsys.readouterr().out


@pytest.mark.parametrize(
    "words",
    [
        "(weggefallen)",
        "[Repealed]",
        "[section 2 repealed by section 5 of Act 10 of 2001]",
        "Section 2 was revoked with effect from 1 May 2001.",
        "Abrogé par le décret 2001-251",
    ],
)
def test_a_section_that_only_says_that_it_is_gone_is_told_and_no_draft(tmp_path: Path, words: str) -> None:
    body = section("1", said("Repealed signs may stand for a month.")) + section("2", said(words))
    statute = read(tmp_path, AKN.format(meta="", body=body, after=""))
    assert list(texts(statute)) == ["s. 1"]
    assert statute.left == ("not in force, left out: Road Act s. 2",)


NORM = "<norm><metadaten><enbez>§ {n}</enbez></metadaten><textdaten>{notes}<text><Content>{text}</Content></text></textdaten></norm>"


def test_a_section_without_words_is_told(tmp_path: Path) -> None:
    remark = "<content><p><remark>[section 2 repealed]</remark></p></content>"
    akn = AKN.format(meta="", body=section("1", said("Keep left.")) + section("2", remark), after="")
    british = CLML.format(body=p1("1", "<Text>Keep left.</Text>") + p1("2", "<Text>. . . . .</Text>"), after="")
    for text in (akn, british):
        assert read(tmp_path, text).left == ("without a text (repealed?), left out: Road Act s. 2",)
    german = NORM.format(n=1, text="<P>Links.</P>", notes="") + NORM.format(n=2, text="<P>-</P>", notes="")
    assert read(tmp_path, GII.format(body=german)).left == ("without a text (repealed?), left out: StO § 2",)


def test_what_is_read_is_never_told_as_left_out(tmp_path: Path) -> None:
    note = "<fussnoten><Content><P>A note.</P></Content></fussnoten>"
    text = "<P>(1) Rechts fahren.</P><P>(1a)Langsam<DL><DT>1.</DT><DD><LA>im Ort.</LA></DD></DL></P>"
    statute = read(tmp_path, GII.format(body=NORM.format(n=1, text=text, notes=note)))
    assert {each.cited: each.text for each in statute.sections} == {
        "StO § 1 Abs. 1": "Rechts fahren.",
        "StO § 1 Abs. 1a": "Langsam 1. im Ort.",
    }
    assert statute.left == ()
    listed = (
        "<blockList><listIntroduction>No one shall</listIntroduction><item><num>(a)</num><p>run</p></item></blockList>"
    )
    akn = read(tmp_path, AKN.format(meta="", body=section("1", f"<content>{listed}</content>"), after=""))
    assert texts(akn) == {"s. 1": "No one shall (a) run"}
    assert akn.left == ()


def test_a_number_keeps_its_letters_and_loses_its_label(tmp_path: Path) -> None:
    body = "".join(
        f"<{kind}><num>{num}</num>{said('Keep left.')}</{kind}>"
        for kind, num in (("article", "Article R413-2"), ("section", "Section 12A"), ("article", "Art. 5 bis"))
    )
    statute = read(tmp_path, AKN.format(meta="", body=body, after=""))
    assert list(texts(statute)) == ["art. R413-2", "s. 12A", "art. 5 bis"]


def test_cells_and_lines_stand_apart(tmp_path: Path) -> None:
    table = "<table><tr><th>Class</th><th>km/h</th></tr><tr><td>Bus</td><td>60</td></tr></table>"
    akn = AKN.format(meta="", body=section("1", f"<content>{table}<p>one<eol/>two</p></content>"), after="")
    assert texts(read(tmp_path, akn)) == {"s. 1": "Class km/h Bus 60 one two"}
    british = CLML.format(body=p1("1", f"<Tabular>{table}</Tabular>"), after="")
    assert texts(read(tmp_path, british)) == {"s. 1": "Class km/h Bus 60"}


@pytest.mark.parametrize(
    ("written", "read_as"),
    [
        ("v<sup>2</sup>/20", "v²/20"),
        ("80 m<sup> 3 </sup>", "80 m ³"),
        ("Art. 1<sup>bis</sup>", "Art. 1bis"),
        ("the 1<sup>st</sup> lane", "the 1st lane"),
        ("CO<sub>2</sub>", "CO2"),
        ("para. 2<sup>1)</sup>", "para. 2¹⁾"),
        ("10<sup>-3</sup> m, 10<sup>−3</sup> m", "10⁻³ m, 10⁻³ m"),
        ("turned by 45<sup>o</sup>", "turned by 45°"),
        ("x<sup>n+1</sup>", "xⁿ⁺¹"),
        ("30<sup>*</sup> km/h", "30* km/h"),
        ("v<sup>1,5</sup>", "v^(1,5)"),
        ("60<sup>Q</sup>", "60^(Q)"),
        ("m<sup><i>2</i></sup> 30<sup><b>1</b>)</sup> km/h", "m² 30¹⁾ km/h"),
        ("30<sup>2<sup>3</sup></sup>", "30²³"),
        ("30<sup><noteRef/></sup> km/h", "30 km/h"),
    ],
)
def test_raised_text_is_no_letter_or_digit_of_what_is_before_it(written: str, read_as: str, tmp_path: Path) -> None:
    akn = AKN.format(meta="", body=section("1", f"<content><p>{written}</p></content>"), after="")
    assert texts(read(tmp_path, akn)) == {"s. 1": read_as}


def test_a_character_that_has_a_name_is_not_lost(tmp_path: Path) -> None:
    said = '<Text>Class 1<Character Name="NonBreakingSpace"/>30 mph, <Character Name="Minus"/>5 C.</Text>'
    group = f"<P1group><Title>Cars</Title>{p1('1', said)}</P1group>"
    assert texts(read(tmp_path, CLML.format(body=group, after=""))) == {"s. 1": "Class 1 30 mph, −5 C."}


def test_a_paragraph_in_a_part_of_a_schedule_is_cited_by_its_schedule_and_has_no_other_ones_heading(
    tmp_path: Path,
) -> None:
    paragraph = p1("1", "<Text>Buses: 50.</Text>").replace("section-1", "schedule-2-part-1-paragraph-1")
    after = f"<Schedules><Schedule><ScheduleBody><Part>{paragraph}</Part></ScheduleBody></Schedule></Schedules>"
    group = f"<P1group><Title>Cars</Title>{p1('1', '<Text>Keep left.</Text>')}</P1group>"
    statute = read(tmp_path, CLML.format(body=group, after=after))
    assert texts(statute) == {"s. 1": "Keep left.", "Sch. 2 para. 1": "Buses: 50."}
    assert [each.heading for each in statute.sections] == ["Cars", ""]


@pytest.mark.parametrize(
    ("extent", "told"), [("S", True), ("N.I.", True), ("S+N.I.", True), ("E+W+S", False), ("", False)]
)
def test_what_extends_to_a_part_without_england_is_drafted_and_told(tmp_path: Path, extent: str, told: bool) -> None:
    law = p1("3", "<Text>At most 30.</Text>", f'RestrictExtent="{extent}"' if extent else "")
    statute = read(tmp_path, CLML.format(body=law, after=""))
    assert texts(statute) == {"s. 3": "At most 30."}
    assert any(f"section-3 ({extent})" in each for each in statute.left) is told


@pytest.mark.parametrize(
    "label", ["Artikel 5", "Articolo 5", "Artículo 5", "Artykuł 5", "Art 5", "Artigo 5", "Paragraf 5"]
)
def test_a_label_in_another_language_is_no_part_of_the_number(label: str, tmp_path: Path) -> None:
    body = f"<article><num>{label}.</num>{said('Keep left.')}</article>"
    assert list(texts(read(tmp_path, AKN.format(meta="", body=body, after="")))) == ["art. 5"]


def test_a_heading_between_parts_is_no_text_of_any(tmp_path: Path) -> None:
    first, second = PARTS.split("</paragraph>")[:2]
    body = section("5", f"{first}</paragraph><crossHeading>Elsewhere</crossHeading>{second}</paragraph>")
    statute = read(tmp_path, AKN.format(meta="", body=body, after=""))
    assert texts(statute) == {"s. 5(a)": "60 in a town;", "s. 5(b)": "100 elsewhere,"}
    assert statute.left == ()


@pytest.mark.parametrize("status", ["expired", "suspended", "notInForce", "not-in-force", "proposed"])
def test_a_section_that_is_not_in_force_by_another_word_is_left_out(status: str, tmp_path: Path) -> None:
    body = section("1", said("Keep left.")) + section("2", said("Any speed."), f'status="{status}"')
    statute = read(tmp_path, AKN.format(meta="", body=body, after=""))
    assert list(texts(statute)) == ["s. 1"]
    assert "Any speed." in statute.left[0]


def test_a_picture_in_a_section_is_told(tmp_path: Path) -> None:
    akn = AKN.format(meta="", body=section("1", said('The sign is <img src="a.png" alt="red disc"/>.')), after="")
    assert read(tmp_path, akn).left == ("pictures, not read: 1 part: 'red disc'",)
    british = CLML.format(body=p1("1", '<Text>The sign is</Text><Figure><Image ResourceRef="r1"/></Figure>'), after="")
    assert read(tmp_path, british).left == ("pictures, not read: 1 part: 'r1'",)


def test_a_part_of_an_act_tells_its_provisions_where_they_count(tmp_path: Path) -> None:
    inside = p1("2", "<Text>Left.</Text>") + p1("3", "<Text>Slow.</Text>", 'RestrictExtent="E+W+S"')
    body = f'<Part RestrictExtent="S">{inside}</Part>{p1("4", "<Text>Stop.</Text>")}'
    statute = read(tmp_path, CLML.format(body=body, after=""))
    assert statute.left == ("does not extend to England, drafted all the same: section-2 (S)",)


@pytest.mark.parametrize(
    ("numbers", "cited"),
    [
        ("(2) bis (4)", "2 bis 4"),
        ("(2), (3)", "2, 3"),
        ("(2),(3) und (4)", "2, 3 und 4"),
        ("(2) u. (3)", "2 und 3"),
        ("(2) - (4)", "2 bis 4"),
        ("(2)–(4)", "2 bis 4"),
        ("(2, 3)", "2, 3"),
        ("(2 bis 4)", "2 bis 4"),
        ("(2 a) bis (4)", "2a bis 4"),
        ("(2) sowie (3a)", "2 sowie 3a"),
    ],
)
def test_german_paragraphs_that_are_gone_together_are_left_out(numbers: str, cited: str, tmp_path: Path) -> None:
    inside = f"<P>(1) Rechts.</P><P>{numbers} (weggefallen)</P><P>( 5 ) Links.</P>"
    norm = f"<norm><metadaten><enbez>§ 6</enbez></metadaten><textdaten><text><Content>{inside}</Content></text></textdaten></norm>"
    statute = read(tmp_path, GII.format(body=norm))
    assert [each.cited for each in statute.sections] == ["StO § 6 Abs. 1", "StO § 6 Abs. 5"]
    assert statute.left == (f"not in force, left out: StO § 6 Abs. {cited}",)


def test_a_german_paragraph_whose_letter_stands_apart_is_one_of_its_own_and_a_year_is_none(tmp_path: Path) -> None:
    inside = "<P>(1) Im Ort 40 km/h.</P><P>(1999) noch 50 km/h.</P><P>(1 a) Mit Anhänger 30 km/h.</P><P>(2) Sonst 70 km/h.</P>"
    statute = read(tmp_path, GII.format(body=NORM.format(n=6, text=inside, notes="")))
    assert {each.cited: each.text for each in statute.sections} == {
        "StO § 6 Abs. 1": "Im Ort 40 km/h. (1999) noch 50 km/h.",
        "StO § 6 Abs. 1a": "Mit Anhänger 30 km/h.",
        "StO § 6 Abs. 2": "Sonst 70 km/h.",
    }
    assert [each.key for each in statute.sections] == ["6-1", "6-1a", "6-2"]
    assert statute.left == ()


def test_a_number_of_two_chapters_is_cited_with_its_chapter_and_unnumbered_parts_by_their_place(tmp_path: Path) -> None:
    parts = "".join(f"<subsection>{said(text)}</subsection>" for text in ("Left.", "Slow."))
    body = (
        f"<chapter><num>1</num><section><num>1 §</num>{parts}</section><section><num>2 §</num>{said('Stop.')}</section></chapter>"
        f"<chapter><num>2</num><section><num>1 §</num>{said('Wait.')}</section></chapter>"
    )
    statute = read(tmp_path, AKN.format(meta="", body=body, after=""))
    assert texts(statute) == {"1:1 § Abs. 1": "Left.", "1:1 § Abs. 2": "Slow.", "§ 2": "Stop.", "2:1 §": "Wait."}
    assert len({each.key for each in statute.sections}) == 4


def test_a_section_of_sections_is_drafted_once(tmp_path: Path) -> None:
    statute = read(tmp_path, AKN.format(meta="", body=section("6", section("6.1", said("Wait."))), after=""))
    assert texts(statute) == {"s. 6.1": "Wait."}


WHOLE = "the whole statute is marked as not in force, drafted all the same: "


@pytest.mark.parametrize(
    ("event", "left"),
    [
        ('type="repeal" date="2010-01-01"', (f"{WHOLE}repealed on 2010-01-01",)),
        ('type="repeal"', (f"{WHOLE}repealed on a day unknown",)),
        ('type="repeal" date="2999-01-01"', ()),
        ('type="amendment" date="2010-01-01"', ()),
    ],
)
def test_an_act_whose_life_cycle_ended_is_told(event: str, left: tuple[str, ...], tmp_path: Path) -> None:
    meta = f'<lifecycle><eventRef date="2000-01-01" type="generation"/><eventRef {event}/></lifecycle>'
    statute = read(tmp_path, AKN.format(meta=meta, body=section("1", said("Keep left.")), after=""))
    assert texts(statute) == {"s. 1": "Keep left."}
    assert statute.left == left


@pytest.mark.parametrize(
    ("attributes", "reason"), [('Status="Repealed"', "repealed"), ('RestrictEndDate="1999-01-01"', "until 1999-01-01")]
)
def test_a_british_act_that_is_marked_as_a_whole_is_told(attributes: str, reason: str, tmp_path: Path) -> None:
    law = CLML.format(body=p1("1", "<Text>Keep left.</Text>"), after="")
    statute = read(tmp_path, law.replace("<Legislation", f"<Legislation {attributes}"))
    assert texts(statute) == {"s. 1": "Keep left."}
    assert statute.left == (WHOLE + reason,)


@pytest.mark.parametrize(("kind", "left"), [("Aufh", (f"{WHOLE}V aufgeh. mWv 1.1.2010",)), ("Stand", ())])
def test_a_german_statute_that_was_repealed_is_told(kind: str, left: tuple[str, ...], tmp_path: Path) -> None:
    state = (
        f"<standangabe><standtyp>{kind}</standtyp><standkommentar>V aufgeh. mWv 1.1.2010</standkommentar></standangabe>"
    )
    law = GII.format(body=NORM.format(n=1, text="<P>Rechts fahren.</P>", notes=""))
    statute = read(tmp_path, law.replace("</metadaten>", f"{state}</metadaten>", 1))
    assert [each.text for each in statute.sections] == ["Rechts fahren."]
    assert statute.left == left


def test_other_versions_of_a_british_provision_are_told(tmp_path: Path) -> None:
    group = f'<P1group RestrictExtent="S"><Title>Cars</Title>{p1("1", "<Text>Keep to 20.</Text>")}</P1group>'
    picture = '<Version id="v2"><Figure><Image ResourceRef="r1"/></Figure></Version>'
    bare = '<Version id="v3"><Text>Stop.</Text></Version>'
    after = f'</Primary><Versions><Version id="v1">{group}</Version>{picture}{bare}</Versions><Primary>'
    statute = read(tmp_path, CLML.format(body=IN_FORCE, after=after))
    assert texts(statute) == {"s. 1": "Keep to 30."}
    assert statute.left == (
        "other versions of provisions, left out: 2 parts: section-1 'Cars (1) Keep to 20.' (S); v3 'Stop.' (no extent)",
    )


def test_a_note_in_a_title_a_heading_or_a_number_is_no_part_of_it(tmp_path: Path) -> None:
    note = "<authorialNote><p>Since 1999.</p></authorialNote>"
    part = f"<paragraph><num>1{note}</num>{said('Keep left.')}</paragraph>"
    body = f"<section><num>5{note}</num><heading>Cars{note}</heading>{part}</section>"
    annex = (
        f"<attachment name='annex'><num>Annex 1{note}</num><paragraph><num>2{note}</num><heading>Vans{note}</heading>"
    )
    annex += f"{said('Stop.')}</paragraph></attachment>"
    law = AKN.format(meta="", body=body, after=annex).replace("Road Act<", f"Road Act{note}<")
    statute = read(tmp_path, law)
    assert texts(statute) == {"s. 5(1)": "Keep left.", "Annex 1 para. 2": "Stop."}
    assert [each.heading for each in statute.sections] == ["Cars", "Vans"]
    assert statute.left == ()
