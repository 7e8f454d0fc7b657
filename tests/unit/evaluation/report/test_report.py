"""The report and the page: whole, linked, without the network."""

import re
from html.parser import HTMLParser
from pathlib import Path

import msgspec
import pytest

from drivemcp.errors import UserError
from evaluation.campaign.plan import Row
from evaluation.campaign.store import Kept
from evaluation.report import report
from evaluation.report.page import BEGIN, END, page, reading_of, write
from evaluation.report.reading import contradictions
from evaluation.report.report import About
from evaluation.tables.goals import judged
from evaluation.tables.tables import Table
from tests.unit.evaluation.evaluate.made import kept, moment, table

pytest.importorskip("matplotlib")


def made_run(row: Row, number: int) -> Kept | None:
    if row.key == "dynamic-vsl/Oracle":
        return None
    return msgspec.structs.replace(kept(), moments=(moment("collision.jpg"),)) if number else kept()


def told(tables: list[Table]) -> About:
    return report.about(tables, "drivemcp evaluate results --quick", quick=True, latencies="fixed, 4 ms a call")


class Links(HTMLParser):
    """Where links lead, which places have names, and which elements are open."""

    def __init__(self) -> None:
        super().__init__()
        self.leads: list[str] = []
        self.names: set[str] = set()
        self.open: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        told = dict(attrs)
        self.leads += [told["href"] or ""] if tag == "a" and "href" in told else []
        self.names |= {told["id"] or ""} if "id" in told else set()


def test_every_number_leads_to_its_runs_and_every_run_to_its_log(tmp_path: Path) -> None:
    tables = [table("results", made_run), table("corruption", made_run)]
    for run in (run for each in tables for row in each.rows for run in row.runs if run.kept):
        folder = tmp_path / "runs" / run.key
        folder.mkdir(parents=True, exist_ok=True)
        for name in ("log.mcap", "metrics.json", "spec.json"):
            (folder / name).touch()
        (folder / "collision.jpg").write_bytes(b"JPEG")
    text = report.html(tables, told(tables), tmp_path / "runs", tmp_path)
    links = Links()
    links.feed(text)
    inner = {lead[1:] for lead in links.leads if lead.startswith("#")}
    assert inner
    assert inner <= links.names
    assert all((tmp_path / lead).exists() for lead in links.leads if not lead.startswith("#"))
    assert "drivemcp replay runs/" in text
    assert "data:image/jpeg;base64,SlBFRw==" in text, "the picture of a worst moment"
    assert "tick 120" in text
    assert "its process ended with 9" in text, "a failed run is told"
    assert not re.findall(r"(?:src|href)=['\"]https?:", text), "no network"


def test_every_table_has_plots_and_a_report() -> None:
    for name, count in (("results", 3), ("corruption", 4), ("delta", 1), ("ablation", 1), ("can-fault", 2)):
        tables = [table(name, lambda row, number: kept())]  # type: ignore[arg-type]
        text = report.html(tables, told(tables), Path("runs"), Path())
        assert text.count("<svg") == count, name


def test_a_report_of_nothing_says_so() -> None:
    tables = [table("delta", lambda row, number: None)]
    text = report.html(tables, told(tables), Path("runs"), Path())
    assert "not measured" in text
    assert "nothing driven" in text
    assert "Nothing was driven." in text


def test_the_page_has_the_tables_beside_the_papers_numbers() -> None:
    tables = [table("results", made_run), table("can-fault", lambda row, number: kept())]
    text = page(tables, told(tables))
    assert "| CROSS-BORDER: DriveMCP | 2, 4.00 | 5.00 ± 0.00 [0.61, 18.06] / 0.2±0.1 | 0.50 ± 0.00 / 0.7 |" in text
    assert "drivemcp evaluate results --quick" in text
    assert "proves" not in text
    assert all(line.count("|") in (5, 6, 7, 8, 9) for line in text.splitlines() if line.startswith("|"))


def test_what_is_told_apart_is_bold() -> None:
    def made(row: Row, number: int) -> Kept:
        return kept(infractions_total=2 * (row.spec.method == "No-assistant"), distance_m=1000.0 * (number + 1))

    text = page(tables := [table("results", made, 8)], told(tables))
    (line,) = (line for line in text.splitlines() if line.startswith("| CROSS-BORDER: No-assistant less DriveMCP |"))
    assert line.split(" | ")[1].startswith("**+6.79 ["), "infractions"
    assert line.count("**") == 2, "nothing else differs"


def test_page_and_report_explain_the_mark_of_latencies_only_where_a_row_has_it() -> None:
    for latencies, marked in (({}, True), ({"retrieve": 22.4, "applicable_limit": 0.6, "answer_prompt": 0.6}, False)):
        tables = [table("results", lambda row, number: kept(), modelled_ms=latencies)]
        for text in (page(tables, told(tables)), report.html(tables, told(tables), Path("runs"), Path())):
            assert ("Those marked" in text) == marked


def test_the_page_has_what_the_paper_does_not_measure_for_each_method() -> None:
    text = page([whole := table("results", made_run)], told([whole]))
    (head,) = [line for line in text.splitlines() if line.startswith("| CROSS-BORDER | ")]
    assert (
        head
        == "| CROSS-BORDER | No-assistant | VLM-Direct | VLM-Direct+RAG | VLM-Tools-NoArbiter | DriveMCP | Oracle | Obedient driver |"
    )
    for number in ("nags, /10 km", "collisions, /1,000 km", "wrong limit, s/h", "false interventions, /1,000 km"):
        assert len(re.findall(rf"^\| {re.escape(number)} \| (?:[^|]+ \| ){{6}}[^|]+ \|$", text, re.MULTILINE)) == 3


def test_page_and_report_say_why_latencies_are_in_no_order() -> None:
    for latencies, there in (({}, True), ({"retrieve": 22.4, "applicable_limit": 0.6, "answer_prompt": 0.6}, False)):
        tables = [table("results", lambda row, number: kept(), modelled_ms=latencies)]
        for text in (page(tables, told(tables)), report.html(tables, told(tables), Path("runs"), Path())):
            assert ("18 not measured (18 of them latencies that are assumed" in text) == there
            assert (len(re.findall(r"0\.060[^|]*<i>assumed</i>|0\.060[^|]*\*assumed\*", text)) > 0) == there


@pytest.mark.parametrize(
    ("machines", "told_as"),
    [
        (("one", "one"), "one"),
        (("one", "other"), "1 run on one; 1 run on other"),
        (("", ""), "a machine that was not noted"),
    ],
)
def test_it_tells_on_which_machines_the_runs_were_driven(machines: tuple[str, str], told_as: str) -> None:
    def driven_on(row: Row, number: int) -> Kept | None:
        return msgspec.structs.replace(kept(), machine=machines[number]) if row.key == "cross-border/Oracle" else None

    assert told([table("results", driven_on)]).machine == told_as


def test_rows_that_another_backend_made_say_so() -> None:
    mixed = table("results", made_run, settings={"drivelm": {"prompt_backend": "openai"}})
    text, whole = page([mixed], told([mixed])), report.html([mixed], told([mixed]), Path("runs"), Path())
    assert "DriveLM backend: embedded, openai." in text
    assert "| CROSS-BORDER: VLM-Direct (openai) | " in text
    assert "| CROSS-BORDER: DriveMCP (embedded) | " in text
    assert "<b>VLM-Direct (openai)</b>" in whole
    assert "no language model" not in whole
    plain = table("results", made_run)
    text, whole = page([plain], told([plain])), report.html([plain], told([plain]), Path("runs"), Path())
    assert "| CROSS-BORDER: VLM-Direct | " in text
    assert "no language model" in whole


def test_a_page_shows_its_plots_and_is_the_same_for_the_same_numbers(tmp_path: Path) -> None:
    tables, file = [table("results", made_run), table("corruption", made_run)], tmp_path / "results.md"
    write(file, tables, told(tables))
    shown = re.findall(r"^!\[(.+)\]\((.+\.svg)\)$", file.read_text(encoding="utf-8"), re.MULTILINE)
    assert len(shown) == 7
    pictures = {path: (tmp_path / path).read_bytes() for _, path in shown}
    assert set(tmp_path.glob("results/*.svg")) == {tmp_path / path for path in pictures}
    assert all(picture.startswith(b"<svg") and b"xmlns=" in picture for picture in pictures.values())
    write(file, tables, told(tables))
    assert {path: (tmp_path / path).read_bytes() for path in pictures} == pictures


def test_the_page_of_recorded_answers_has_the_same_bytes_on_another_machine_at_another_commit(tmp_path: Path) -> None:
    tables, file = [table("proposer", made_run)], tmp_path / "language-model.md"
    (tmp_path / "guard.md").write_text("| a yardstick |\n", encoding="utf-8")
    here = msgspec.structs.replace(told(tables), cassette="answers.jsonl.gz, SHA-256 0123")
    there = msgspec.structs.replace(here, machine="elsewhere", commit="fedcba", wall_s=here.wall_s + 60.0)
    pages = []
    for each in (here, there):
        write(file, tables, each)
        pages.append(file.read_bytes())
    assert pages[0] == pages[1]
    assert b"driven by the recorded answers of answers.jsonl.gz" in pages[0]
    assert b"yardstick" not in pages[0]


def test_what_is_written_between_the_marks_stays_and_all_else_is_made_anew(tmp_path: Path) -> None:
    tables, file = [table("delta", lambda row, number: kept())], tmp_path / "results.md"
    write(file, tables, told(tables))
    made = file.read_text(encoding="utf-8")
    reading = "- **What it means**: little.\n\n## Before\n\nMore of it."
    edited = made.replace(f"{BEGIN}\n\n{END}", f"{BEGIN}\n{reading}\n{END}").replace(
        "a test's machine", "another machine"
    )
    assert edited != made
    file.write_text(edited, encoding="utf-8")
    write(file, tables, told(tables))
    assert file.read_text(encoding="utf-8") == made.replace(f"{BEGIN}\n\n{END}", f"{BEGIN}\n{reading}\n{END}")


def test_a_page_without_both_marks_is_not_written_over(tmp_path: Path) -> None:
    tables, file = [table("delta", lambda row, number: kept())], tmp_path / "results.md"
    file.write_text(f"Old words. {BEGIN} and the end is gone", encoding="utf-8")
    with pytest.raises(UserError, match=r"results\.md: the page has no lines"):
        write(file, tables, told(tables))
    assert file.read_text(encoding="utf-8").startswith("Old words")


def test_what_cannot_follow_from_the_paper_is_worked_out_from_its_numbers() -> None:
    text = " ".join(contradictions())
    for shown in ("0.4 r - 0.55", "18, 12, 8, 5, 4 %", "2.1 s", "0.73 against 0.7 s", "300 km"):
        assert shown in text


def test_goals_are_judged_of_the_rows_that_were_asked_for() -> None:
    whole = table("results", made_run)
    ours = msgspec.structs.replace(whole, rows=tuple(row for row in whole.rows if row.row.spec.method == "DriveMCP"))
    told_of = {each.what for each in judged([ours])}
    assert told_of
    assert told_of < {each.what for each in judged([whole])}, "what compares methods is not among them"
    assert not judged([msgspec.structs.replace(whole, rows=())])


def test_runs_without_a_key_yet_are_counted_each() -> None:
    """Those of a row that adapts, while its first is not driven."""
    whole = table("ablation", lambda row, number: None, 4)
    keyless = [
        msgspec.structs.replace(row, runs=tuple(msgspec.structs.replace(run, key="") for run in row.runs))
        for row in whole.rows
    ]
    assert told([msgspec.structs.replace(whole, rows=tuple(keyless))]).missing == 4 * len(keyless)


def test_a_run_that_counts_is_not_told_as_failed() -> None:
    whole = table("delta", lambda row, number: kept())
    before = [
        msgspec.structs.replace(
            row, runs=tuple(msgspec.structs.replace(run, problem="it failed once") for run in row.runs)
        )
        for row in whole.rows
    ]
    tables = [msgspec.structs.replace(whole, rows=tuple(before))]
    assert "it failed once" not in report.html(tables, told(tables), Path("runs"), Path())


def test_a_worst_moment_is_told_with_the_row_that_it_is_of() -> None:
    def made(row: Row, number: int) -> Kept:
        return msgspec.structs.replace(kept(), moments=(moment(),) if row.key == "sign_miss=0.5" else ())

    tables = [table("corruption", made)]
    text = report.html(tables, told(tables), Path("runs"), Path())
    assert "corruption, signs missed: signs missed, 50 %, run 0" in text


def test_a_picture_is_a_file_of_its_run_and_of_nothing_else(tmp_path: Path) -> None:
    (secret := tmp_path / "secret.jpg").write_bytes(b"SECRET")
    for name in (str(secret), "../../secret.jpg"):

        def made(row: Row, number: int, name: str = name) -> Kept:
            return msgspec.structs.replace(kept(), moments=(moment(name),))

        tables = [table("delta", made)]
        for row in tables[0].rows:
            for run in row.runs:
                (tmp_path / "runs" / run.key).mkdir(parents=True, exist_ok=True)
        assert "data:image" not in report.html(tables, told(tables), tmp_path / "runs", tmp_path)


def test_a_page_that_cannot_be_written_stays_as_it_was(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    tables, file = [table("delta", lambda row, number: kept())], tmp_path / "results.md"
    file.write_text(before := f"{BEGIN}\nWhat somebody wrote.\n{END}\n", encoding="utf-8")

    def full(path: Path, data: bytes) -> None:
        with path.open("wb") as out:
            out.write(data[:10])
        raise OSError(28, "No space left on device", str(path))

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space left"):
        write(file, tables, told(tables))
    assert file.read_text(encoding="utf-8") == before
    assert not list(tmp_path.glob("**/*.part"))


def test_a_page_that_cannot_be_read_is_named(tmp_path: Path) -> None:
    (file := tmp_path / "results.md").write_bytes(b"\xff\xfe")
    for path in (file, tmp_path):
        with pytest.raises(UserError, match=re.escape(f"--docs {path}: ")):
            reading_of(path)


def test_a_run_of_this_folder_whose_log_is_gone_is_not_told_as_published(tmp_path: Path) -> None:
    tables = [table("delta", lambda row, number: kept(), runs=1)]
    for number, row in enumerate(tables[0].rows):
        (folder := tmp_path / row.runs[0].key).mkdir()
        if number == 0:
            (folder / "metrics.json").touch()
    text = report.html(tables, told(tables), tmp_path, tmp_path)
    assert text.count(report.GONE) == 1 + text.count(f"{report.GONE}:")
    assert text.count("published, its log is not here") == len(tables[0].rows) - 1


def test_the_page_begins_with_the_fields_yardsticks_that_lie_beside_it(tmp_path: Path) -> None:
    tables, file = [table("delta", lambda row, number: kept())], tmp_path / "results.md"
    write(file, tables, told(tables))
    assert "yardsticks" not in file.read_text(encoding="utf-8")
    (tmp_path / "guard.md").write_text(
        "# Guard\n\n| scene | hit |\n|---|---|\n| cut-in | 0 |\n\nMore.\n\n| no | more |\n"
    )
    (tmp_path / "isa.md").write_text("# Isa\n\n| what | value |\n|---|---|\n| right | 99 % |\n")
    write(file, tables, told(tables))
    text = file.read_text(encoding="utf-8")
    places = [
        text.index(each)
        for each in ("# Results", "| right | 99 % |", "| cut-in | 0 |", "## The paper's tables", "## delta")
    ]
    assert places == sorted(places)
    assert "| no | more |" not in text
