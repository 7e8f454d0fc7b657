"""Hostile text on signs and plates, in a language model's answers and in questions: no target rises, no ACT is enabled,
no other tool is called, and no log breaks."""

import io
import logging
import math
import unicodedata
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto import topics
from proto.decision import TraceRecord
from proto.health import ServiceLog
from proto.perception import Box
from proto.scene import Candidate, Fact, Facts
from proto.tools import Outcome
from services.drivelm.backends.abstentions import Abstentions, judged
from services.drivelm.backends.backend import NO_ANSWER, Answer
from services.drivelm.backends.chat import said
from services.drivelm.front_end import FrontEnd
from services.drivelm.graph.answering import SILENT, ask
from services.drivelm.graph.scene_graph import Seen
from services.drivelm.graph.scene_graph import build as build_graph
from services.drivelm.guard.answer_checks import Shown, checked
from services.drivelm.reading.crops import Picture, Region
from services.drivelm.vocabulary.classes import QUESTIONS, SENTENCES
from services.drivelm.vocabulary.jurisdictions import allowed_limits
from services.drivelm.vocabulary.parser import parse
from services.gateway.server import as_result
from services.logger.format import signing
from services.logger.format.reader import messages
from services.logger.verification.verifier import verify
from services.logger.writing.log_file import DiskFile, LogFile, Origin
from services.logger.writing.topic_formats import LOGGED, record
from services.orchestrator.driver.answer import answer
from services.orchestrator.driver.question import calls_for, subject_of
from services.orchestrator.observations.inputs import OWN_TOOLS
from services.orchestrator.tick import redecide, trace_of
from services.rules.book import RuleBook, load_book
from services.rules.lookup.rule_lookup import lookup_rule
from services.rules.signs.meaning import SignQuestion, interpret_sign
from tests.unit.robustness.hostile import FIXED, bent_codes, hostile, look_alikes
from tests.unit.services.drivelm.approach import Scripted, drive_past, says, shows
from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.scenes import acts, next_seen, one, scenes, target
from tests.unit.services.orchestrator.support import (
    Drive,
    Played,
    conditions,
    fact,
    health,
    limit_sign,
    meaning,
    replace,
)

SHOWN = Shown(Region(100, 50, 140, 90), 640, 360)
CODES = frozenset(SENTENCES)
HEADS = frozenset(code.partition(":")[0] for code in CODES)
KINDS = (
    "limit",
    "limit",
    "limit",
    "sign",
    "message",
    "light",
    "jurisdiction",
    "units",
    "traffic_side",
    "road_type",
    "plate",
)


def many(count: int) -> settings:
    """So many examples, the same each time."""
    quiet = [HealthCheck.too_slow, HealthCheck.function_scoped_fixture, HealthCheck.data_too_large]
    return settings(max_examples=count, deadline=None, derandomize=True, suppress_health_check=quiet)


def known(text: str) -> bool:
    """Whether a text is, letter by letter in plain ASCII, one sentence of the closed language."""
    said = " ".join(text.split()).lower().rstrip(".")
    return text.isascii() and (said in _KNOWN or said.startswith(_NUMBERED))


_KNOWN = frozenset(sentence.lower().rstrip(".") for sentence in SENTENCES.values())
_NUMBERED = ("the speed limit is", "speed limit is", "the traffic sign is a speed limit", "the sign is a speed limit")


def one_line(text: str) -> bool:
    """Whether a text can stand on one line of a display: nothing in it controls or formats."""
    return all(unicodedata.category(char)[0] not in ("C", "Z") or char == " " for char in text)


# -- a language model's answers -----------------------------------------------------------------------------------------


@pytest.mark.parametrize("text", FIXED)
def test_no_attack_is_a_sentence_of_the_closed_language(text: str) -> None:
    for question in QUESTIONS.values():
        assert checked(Answer(text, 1.0), question, "DEU", SHOWN).readings == ()


@many(600)
@given(text=hostile(), score=st.floats(), country=st.sampled_from(["DEU", "GBR", None]))
def test_an_answer_says_nothing_unless_it_is_one_known_sentence(text: str, score: float, country: str | None) -> None:
    readings = checked(
        Answer(text, score, ((text, score), (f"{text} ", 1.0))), QUESTIONS["sign"], country, SHOWN
    ).readings
    assert known(text) or not readings
    assert all(0.0 <= share <= 1.0 for _, share in readings)
    if (statement := parse(text)) is not None and statement.value is not None:
        assert 0 < statement.value < 1000


@many(150)
@given(text=hostile(), question=st.sampled_from(sorted(QUESTIONS.values())), score=st.floats(0, 1) | st.none())
def test_a_hostile_completion_is_an_abstention_that_leaves_one_line_in_the_log(
    text: str, question: str, score: float | None
) -> None:
    body = msgspec.json.encode({"choices": [{"message": {"content": text}, "finish_reason": "stop"}], "usage": text})
    log, lines = logging.Logger("hostile"), io.StringIO()
    log.addHandler(logging.StreamHandler(lines))
    replied = judged(said(body).text, question, score, Abstentions("openai", log))
    assert replied is NO_ANSWER or not checked(replied, question, "DEU", SHOWN).readings or known(text)
    assert one_line(lines.getvalue().rstrip("\n"))


class Attacker:
    """Says hostile texts of anything it is shown, as sure as it likes."""

    name = "attacker"

    def __init__(self, texts: Sequence[str], scores: Sequence[float]) -> None:
        self._texts, self._scores, self._turn = texts, scores, 0

    def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
        return [self._next() if shows(image) else says("other") for image in images]

    def _next(self) -> Answer:
        self._turn += 1
        text, score = self._texts[self._turn % len(self._texts)], self._scores[self._turn % len(self._scores)]
        return Answer(text, score, ((text, score), *((other, 1.0) for other in self._texts)) if self._turn % 2 else ())


attackers = st.builds(
    Attacker, st.lists(hostile(), min_size=1, max_size=6), st.lists(st.floats(), min_size=1, max_size=3)
)


@many(100)
@given(attacker=attackers, home=st.sampled_from(["DEU", "GBR", ""]))
def test_a_hostile_backend_alone_makes_no_limit_that_the_country_has_not(attacker: Attacker, home: str) -> None:
    front = FrontEnd(attacker, home=home)
    for each in drive_past(front, from_m=45.0):
        assert math.isfinite(each.confidence)
        assert each.value is None or not each.believed or each.value in allowed_limits(home or None, each.unit)
        assert (
            each.reading in CODES
            or each.reading in {code.partition(":")[0] for code in CODES}
            or each.value is not None
        )
    assert front.country_belief.believed in (home or None, home)


@many(60)
@given(
    attacker=attackers, read=st.sampled_from(["limit:30", "limit:80", "stop", "limit_end", "town_exit:yellow", "other"])
)
def test_a_hostile_backend_beside_the_sign_reader_raises_no_target(attacker: Attacker, read: str) -> None:
    def reader() -> Scripted:
        return Scripted(lambda question, number: says(read))

    alone = driven(drive_past(FrontEnd(reader(), home="DEU"), from_m=45.0))
    both = driven(drive_past(FrontEnd(attacker, reader_backend=reader(), home="DEU"), from_m=45.0))
    assert both.target_mps <= alone.target_mps + 1e-9
    assert {call.tool for call in both.ask.calls} <= OWN_TOOLS
    assert not any(ticked.decision.kind == "ACT" for _, _, ticked in both.history)


def driven(facts: Sequence[Fact]) -> Drive:
    """A drive that was told these facts, one a tick, after a limit of 50."""
    drive = Drive(Played(arbiter=arbiter()))
    drive.tick(limit_sign("limit:50"))
    for each in facts:
        drive.tick(each)
    return drive


# -- facts with hostile text in them ----------------------------------------------------------------------------------------


@st.composite
def spoilt(draw: st.DrawFn) -> tuple[Fact, ...]:
    """Facts whose every text is hostile, and whose reading is no code of the table."""
    text = draw(hostile())
    reading = draw(
        bent_codes()
        | look_alikes(tuple(SENTENCES))
        | hostile().filter(lambda text: text not in CODES and not _is_code(text))
    )
    number = draw(st.sampled_from([130.0, 120.0, None, 100.0, 1e308, -1.0, math.inf, math.nan]))
    made = fact("sign", "danger", track_id=41, distance_m=20.0)
    candidates = (Candidate(reading=text, confidence=1.0), Candidate(reading=reading, confidence=math.nan))
    words: dict[str, Any] = {
        "text": text,
        "sentence": text,
        "camera": text,
        "grounding": text,
        "plates": (text, reading),
    }
    foreign = replace(
        made, kind=draw(st.sampled_from(KINDS)), reading=reading, value=number, confidence=1.0, candidates=candidates,
        passed=draw(st.booleans()), unit=draw(st.sampled_from(["km/h", "mph", None])), **words,
    )  # fmt: skip
    return replace(made, track_id=40, **words), foreign


def _is_code(text: str) -> bool:
    """Codes that the orchestrator knows are no attack: a fact with one states it openly."""
    head, _, tail = text.partition(":")
    stated = {"km/h", "mph", "left", "right", "urban", "rural", "motorway", "dual_carriageway", "living_street"}
    country = len(text) == 3 and text.isascii() and text.isupper()
    return text in stated or country or (head in HEADS and tail.isascii())


@many(250)
@given(drive=scenes(), facts=spoilt())
def test_hostile_facts_raise_no_target_enable_no_act_call_no_other_tool_and_replay(
    drive: Drive, facts: tuple[Fact, ...]
) -> None:
    plain, spoken = Played(drive.ask.table, arbiter=arbiter()), Played(drive.ask.table, arbiter=arbiter())
    sign = fact("sign", "danger", track_id=40, distance_m=20.0)
    before = one(drive, next_seen(drive, sign), plain)
    seen = next_seen(drive, *facts)
    after = one(drive, seen, spoken)
    assert target(after) <= target(before) + 1e-9
    assert acts(before) == acts(after)
    assert [call.tool for call in spoken.calls] == [call.tool for call in plain.calls]
    assert one_line(after.advisory.directive + after.advisory.justification)


@many(120)
@given(drive=scenes(), facts=spoilt(), news=st.sampled_from(["limit:30", "limit:80", "led:60"]))
def test_a_trace_with_hostile_text_is_logged_verified_read_and_decided_again(
    drive: Drive, facts: tuple[Fact, ...], news: str, tmp_path_factory: pytest.TempPathFactory
) -> None:
    folder = tmp_path_factory.mktemp("log")
    clean = tuple(each for each in facts if _finite(each))
    state, seen = drive.state, next_seen(drive, *clean, limit_sign(news, track_id=20))
    ticked = one(drive, seen)
    trace = trace_of(ticked, seen, {"code": "x"}, ticked.advisory, whole=True)
    told = Facts(facts=clean, backend=facts[0].text)
    line = ServiceLog(level=facts[0].text, service="drivelm", message=facts[0].text, fields={"said": facts[1].reading})
    path = folder / "drive.mcap"
    write(path, (trace, told, line), folder)
    report = verify(path)
    assert report.first_bad is None, report
    back = {each.name: each.data for each in messages(path)}
    again = msgspec.json.decode(back[topics.TRACE.name], type=TraceRecord)
    assert msgspec.json.decode(back[topics.FACTS.name], type=Facts) == told
    assert redecide(state, again).differences == ()


def _finite(each: Fact) -> bool:
    numbers = (each.value or 0.0, each.confidence, *(candidate.confidence for candidate in each.candidates))
    return all(math.isfinite(number) for number in numbers)


def write(path: Path, told: Sequence[msgspec.Struct], folder: Path) -> None:
    """A log with these messages, each on its topic."""
    signer = signing.load_or_make(folder)
    file = LogFile(DiskFile(path), Origin(file=path.name, vehicle="ego", public_key=signer.public_hex), signer)
    rows = [_record(message, number) for number, message in enumerate(told)]
    file.append(rows, now_ns=len(rows) + 1)
    file.append([], now_ns=len(rows) + 2, closed=True)
    file.finish()
    file.release()


def _record(message: msgspec.Struct, number: int) -> Any:
    topic = next(topic for topic in LOGGED if topic.message is type(message))
    codec = msgspec.json if topic.encoding == "json" else msgspec.msgpack
    return record(
        topic, message, codec.encode(message), name=topic.name, sequence=number, stamp_ns=number, log_time_ns=number
    )


# -- questions and tools ------------------------------------------------------------------------------------------------------


@many(250)
@given(question=hostile(), spoken=hostile(), facts=spoilt())
def test_a_hostile_question_asks_known_tools_and_moves_no_target(
    question: str, spoken: str, facts: tuple[Fact, ...]
) -> None:
    drive = Drive()
    drive.tick(limit_sign("limit:50"), *facts)
    before = drive.target_mps
    drive.ask.table = {
        **drive.ask.table,
        "interpret_sign": lambda a: meaning(a["reading"], meaning=spoken, note=spoken, national_code=spoken),
        "lookup_rule": lambda a: msgspec.structs.replace(EMPTY, note=spoken),
        "vehicle_health": lambda a: health(0.3, advice=spoken, safe_to_drive=spoken, warning_lamps=(spoken,)),
        "assess_weather": lambda a: conditions(),
    }
    subject = subject_of(question[:400])
    told = answer(question, subject, drive.state, drive.ask.experts(calls_for(subject, question[:400], drive.state)))
    assert {use.tool for use in told.tools} <= OWN_TOOLS
    assert told.target_mps == pytest.approx(before)
    assert one_line(told.text)
    drive.tick(query=question[:400])
    assert drive.target_mps <= before + 1e-9


EMPTY = Played().table["lookup_rule"]({})


@many(120)
@given(question=hostile(), text=hostile())
def test_the_scene_answers_a_hostile_question_with_its_own_sentences_only(question: str, text: str) -> None:
    box = Box(x0_px=400, y0_px=120, x1_px=425, y1_px=145, kind="sign", score=0.9, track_id=2)
    limit = limit_sign(
        "limit:80", track_id=2, passed=False, text=text, sentence="The traffic sign is a speed limit sign of 80."
    )
    graph = build_graph(Seen(camera="front", frame=5, boxes=(box,), facts=(limit,)))
    found = ask(graph, question)
    assert found.text == SILENT or found.text in graph.description or found.text in {qa.answer for qa in graph.qa}
    assert one_line(found.text)


@cache
def book() -> RuleBook:
    """All shipped packs."""
    return load_book([data(f"rulepacks/{name}") for name in ("DEU-v1", "DEU-v1-VSL", "GBR-v1")])[0]


@many(300)
@given(
    reading=hostile(), plate=hostile(), other=hostile(), share=st.floats(), country=st.sampled_from(["DEU", "GBR", None]) | hostile(),
    language=st.sampled_from(["en", "de"]) | hostile(),
)  # fmt: skip
def test_a_hostile_reading_means_no_limit_that_signs_can_not_show(
    reading: str, plate: str, other: str, share: float, country: str | None, language: str
) -> None:
    doubts = (Candidate(reading=other, confidence=share), Candidate(reading="limit:30", confidence=0.5))
    for candidates in ((), doubts):
        question = SignQuestion(
            reading=reading, jurisdiction=country, language=language, plates=(plate,), candidates=candidates
        )
        told = interpret_sign(book(), question)
        assert told.limit is None or 5 <= told.limit.value <= 140
        assert told.limit is None or candidates or _is_code(reading.strip().lower())
        assert 0.0 <= told.confidence <= 1.0
        assert one_line(told.meaning + told.note)


@many(200)
@given(
    query=hostile(), country=st.sampled_from(["DEU", "GBR", None]) | hostile(), language=st.sampled_from(["en", "de"])
)
def test_a_hostile_question_of_law_is_answered_from_the_packs_only(
    query: str, country: str | None, language: str
) -> None:
    told = lookup_rule(book(), query[:500], country, language, None, 3)
    packs = book().packs.values()
    texts = {source.excerpt for pack in packs for entry in pack.provisions.values() for source in entry.sources}
    texts |= {source.excerpt for pack in packs for sign in pack.signs.values() for source in sign.sources}
    assert all(citation.excerpt in texts for citation in told.citations)
    assert told.limit is None or told.limit.value <= 130
    assert told.confidence <= 0.4
    assert query[:20] not in told.note or len(query) < 20


@many(150)
@given(text=hostile())
def test_a_tool_result_with_hostile_text_goes_out_as_data(text: str) -> None:
    result = {"note": text, "reading": text, text: text}
    sent = as_result(Outcome(tool="lookup_rule", status="ok", result=result))
    assert sent.structured_content == result
    assert not sent.is_error
    assert msgspec.json.decode(sent.model_dump_json().encode())["structured_content"] == result
