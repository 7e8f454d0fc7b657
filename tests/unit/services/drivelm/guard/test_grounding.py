"""What picture, sign reader or map do not bear out is not believed, and the fact says why."""

from collections.abc import Callable, Sequence
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.scene import Fact
from services.drivelm.backends.backend import NO_ANSWER, Answer, EmbeddedBackend
from services.drivelm.front_end import FrontEnd
from services.drivelm.guard import answer_checks, grounding, probes
from services.drivelm.guard.answer_checks import Shown
from services.drivelm.reading.crops import Picture, Region
from services.drivelm.reading.reader import Reader
from services.drivelm.vocabulary.classes import KIND_OF_QUESTION, QUESTIONS, SENTENCES
from services.orchestrator.observations.inputs import Observations
from services.orchestrator.state import State
from services.orchestrator.tick import Ticked, trace_of
from services.simulator.signart import draw_face
from tests.unit.services.drivelm.approach import (
    NS,
    PICTURE,
    Scripted,
    box_at,
    drive_past,
    says,
    shows,
    sighting,
    stand_before,
)
from tests.unit.services.orchestrator.support import Drive, limit_sign

SHOWN = Shown(Region(100, 50, 140, 90), 640, 360)


class Teller:
    """A backend that says what a function of picture and question says; counts the pictures."""

    name = "teller"

    def __init__(self, tell: Callable[[Picture, str], Answer]) -> None:
        self._tell = tell
        self.asked = 0

    def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
        self.asked += len(images)
        return [self._tell(image, question) for image in images]


def liar(label: str) -> Teller:
    """Says the same of every picture."""
    return Teller(lambda image, question: says(label if question != QUESTIONS["plate"] else "other"))


class Late(Teller):
    """Answers every question as the one before should have been answered."""

    def __init__(self, seer: Scripted) -> None:
        super().__init__(lambda image, question: self._late(image, question))
        self._seer, self._last = seer, says("other")

    def _late(self, image: Picture, question: str) -> Answer:
        answer, self._last = self._last, self._seer.answer([image], question)[0]
        return answer


def seer(label: str, score: float = 0.97, *others: tuple[str, float]) -> Scripted:
    """Reads what a picture shows, if it shows anything."""
    return Scripted(lambda question, number: says(label, score, *others))


def beside(label: str, reader: str, home: str = "DEU") -> FrontEnd:
    """A backend that sees, and the sign reader beside it."""
    return FrontEnd(seer(label), reader_backend=seer(reader), home=home)


def believed(facts: Sequence[Fact]) -> set[str]:
    """The readings that were ever believed."""
    return {fact.reading for fact in facts if fact.believed}


def may_raise(facts: Sequence[Fact]) -> set[str]:
    """The readings that the orchestrator may raise or end a limit by."""
    return {fact.reading for fact in facts if fact.believed and fact.confidence >= 0.6}


# -- probes ------------------------------------------------------------------------------------------------------------


def test_a_backend_that_ignores_the_picture_is_never_believed_and_the_fact_says_why() -> None:
    facts = drive_past(FrontEnd(liar("limit:130"), home="DEU"))
    assert facts
    assert believed(facts) == set()
    assert facts[-1].grounding == grounding.BLIND
    assert facts[-1].confidence <= 0.5


def test_without_the_guard_it_is_taken_at_its_word() -> None:
    alone = drive_past(FrontEnd(liar("limit:130"), home="DEU", guarded=False))
    assert "limit:130" in believed(alone)
    assert {fact.grounding for fact in alone} == {""}
    beside = FrontEnd(seer("limit:130"), reader_backend=seer("limit:30"), home="DEU", guarded=False)
    assert "limit:130" in may_raise(drive_past(beside))


def test_one_that_answers_the_last_question_is_found_out() -> None:
    assert believed(drive_past(FrontEnd(Late(seer("limit:130")), home="DEU"))) == set()
    facts = drive_past(FrontEnd(Late(seer("light:green")), home="DEU"), kind="light", size_m=1.1)
    assert grounding.BLIND in {fact.grounding for fact in facts}
    assert believed(facts) == set()


def test_one_that_sees_is_believed_and_nothing_is_said_against_it() -> None:
    facts = drive_past(FrontEnd(seer("limit:80"), home="DEU"))
    assert believed(facts) == {"limit:80"}
    assert {fact.grounding for fact in facts} == {""}


def test_one_that_knows_a_blank_picture_is_found_out_by_another_sign() -> None:
    def tell(image: Picture, question: str) -> Answer:
        return says(next(turn) if shows(image) else "other")

    turn = iter(["limit:30"] * 40 + ["limit:130"] * 1000)
    front = FrontEnd(Teller(tell), home="DEU")
    for number in range(12):
        drive_past(front, track_id=number + 1, start_ns=(1 + 20 * number) * NS)
    assert any(not passed for passed in front.guard.probes.passed)


def test_probes_are_rare() -> None:
    front = FrontEnd(seer("limit:80"), home="DEU", max_reads=2)
    stand_before(front, frames=600, per_s=30)
    made, asked = front.guard.probes.made, front.guard.probes.asked
    assert asked >= 600
    assert 3 <= made <= 20
    assert made <= asked * probes.BUDGET + 1


@given(st.lists(st.tuples(st.integers(0, 10**9), st.integers(1, 8)), min_size=1, max_size=200), st.booleans())
@settings(max_examples=50, deadline=None)
def test_never_two_probes_in_a_second_nor_over_the_budget(frames: list[tuple[int, int]], changed: bool) -> None:
    guard, now_ns, made = probes.Probes(), 0, []
    for step_ns, count in frames:
        now_ns += step_ns
        guard.asked += count
        one = probes.Settled(("tele", 1), QUESTIONS["sign"], PICTURE[:8, :8], "limit:80")
        if (probe := guard.choose([one] * count, now_ns)) is not None:
            made.append(now_ns)
            guard.answered(probe, () if changed else (("limit:80", 0.9),))
            assert len(made) <= guard.asked * probes.BUDGET + 1
    assert all(after - before >= NS for before, after in pairwise(made))
    assert guard.stands == changed or not made


def test_a_backend_that_learns_to_look_is_believed_again() -> None:
    guard = probes.Probes()
    one = probes.Settled(("tele", 1), QUESTIONS["sign"], PICTURE[:8, :8], "limit:80")
    probe = probes.Probe(one, probes.blank(one.image), "a blank picture")
    guard.answered(probe, (("limit:80", 0.99),))
    assert not guard.stands
    guard.answered(probe, ())
    assert not guard.stands
    guard.answered(probe, ())
    assert guard.stands


@pytest.mark.parametrize("label", ["limit:80", "limit:30", "stop", "no_entry", "yield", "zone:30"])
def test_the_embedded_reader_stands_its_probes(label: str) -> None:
    backend = EmbeddedBackend(Reader.load(data("models/reader.onnx")))
    face = draw_face("DEU", label, size_px=48)
    share = face[..., 3:] / 255
    image = np.asarray(face[..., :3] * share + 130 * (1 - share), np.uint8)
    before = backend.answer([image], QUESTIONS["sign"])[0]
    assert SENTENCES[label] == before.text
    after = backend.answer([probes.blank(image)], QUESTIONS["sign"])[0]
    assert dict(after.alternatives).get(before.text, 0.0) < probes.UNMOVED


# -- places and questions --------------------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("text", "fault"),
    [
        ("The traffic sign <c1,CAM_FRONT,120,70> is a speed limit sign of 80.", ""),
        ("The traffic sign (120.5, 70) is a speed limit sign of 80.", ""),
        ("The traffic sign <c1,CAM_FRONT,5000,70> is a speed limit sign of 80.", answer_checks.OUTSIDE),
        ("The traffic sign <c1,CAM_FRONT,-4,70> is a speed limit sign of 80.", answer_checks.OUTSIDE),
        ("The traffic sign (600, 300) is a speed limit sign of 80.", answer_checks.NOTHING_THERE),
        ("The traffic light is red.", answer_checks.OTHER_QUESTION),
    ],
)
def test_an_answer_is_of_the_place_and_the_thing_asked_about(text: str, fault: str) -> None:
    said = answer_checks.checked(Answer(text, 0.9), QUESTIONS["sign"], "DEU", SHOWN)
    assert said == answer_checks.CheckedAnswer((), fault) if fault else said.readings == (("limit:80", 0.9),)


def test_one_that_names_places_outside_says_nothing_and_leaves_its_track_in_doubt() -> None:
    turn = iter(range(1000))

    def tell(image: Picture, question: str) -> Answer:
        if not shows(image):
            return says("other")
        if next(turn) < 8:
            return says("limit:80")
        return Answer("The traffic sign <c1,CAM_FRONT,9000,9000> is a speed limit sign of 80.", 0.99)

    facts = drive_past(FrontEnd(Teller(tell), home="DEU"))
    assert any(fact.grounding == answer_checks.OUTSIDE for fact in facts)
    assert not facts[-1].believed


def test_a_box_outside_the_picture_is_not_asked_about() -> None:
    assert answer_checks.inside(SHOWN)
    assert not answer_checks.inside(SHOWN._replace(region=Region(-35, 50, 5, 90)))
    assert not answer_checks.inside(SHOWN._replace(region=Region(float("nan"), 50, 5, 90)))


@pytest.mark.parametrize("count", [0, 1, 5])
def test_another_number_of_answers_than_pictures_is_no_answer(count: int) -> None:
    class Miscounts(Teller):
        def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
            return [says("limit:130")] * count if len(images) != count else []

    front = FrontEnd(Miscounts(lambda image, question: says("limit:130")), home="DEU")
    boxes = tuple(box_at(30, 2 * number - 2, track_id=number + 1) for number in range(3))
    for step in range(5):
        assert front.see(sighting(NS + step * NS // 5, *boxes)) == ()


# -- the sign reader and the map -----------------------------------------------------------------------------------------------


def test_a_limit_that_the_sign_reader_reads_too_is_believed_in_full() -> None:
    facts = drive_past(beside("limit:80", "limit:80"))
    assert "limit:80" in may_raise(facts)
    assert facts[-1].grounding == ""


def test_a_higher_limit_than_the_sign_reader_reads_is_held() -> None:
    facts = drive_past(beside("limit:130", "limit:80"))
    assert believed(facts) == may_raise(facts) == {"limit:80"}
    doubt = next(fact for fact in reversed(facts) if fact.reading == "limit:130")
    assert (doubt.believed, doubt.grounding) == (False, "the sign reader reads limit:80")
    assert {each.reading for each in doubt.candidates} == {"limit:130", "limit:80"}
    assert doubt.track_id > grounding.SAID_IDS


@pytest.mark.parametrize("label", ["limit:30", "stop", "limit_end"])
def test_what_contradicts_the_sign_reader_is_held_and_the_readers_own_may_lower_only(label: str) -> None:
    facts = drive_past(beside(label, "town_exit:yellow" if label == "limit_end" else "limit:80"))
    assert may_raise(facts) == set()
    doubt = next(fact for fact in reversed(facts) if fact.reading == label)
    assert (doubt.believed, doubt.grounding[:21]) == (False, "the sign reader reads")


def test_a_limit_that_nobody_confirms_may_lower_and_not_raise() -> None:
    unsure = FrontEnd(seer("limit:130"), reader_backend=Scripted(lambda q, n: NO_ANSWER), home="DEU")
    facts = drive_past(unsure)
    assert believed(facts) == {"limit:130"}
    assert may_raise(facts) == set()
    assert {fact.grounding for fact in facts} == {grounding.UNCONFIRMED}


def test_a_sign_where_the_reader_sees_none_is_held() -> None:
    facts = drive_past(beside("limit:130", "other"))
    assert believed(facts[2:]) == set()
    assert "sees no sign" in facts[-1].grounding


def test_a_plate_that_the_sign_reader_does_not_see_makes_no_limit_weaker() -> None:
    wet = Scripted(lambda q, n: says("limit:80"), lambda q, n: says("plate:when_wet:de"))
    facts = drive_past(FrontEnd(wet, reader_backend=seer("limit:80"), home="DEU"))
    assert {fact.scope for fact in facts if fact.believed} == {"permanent"}
    assert {fact.plates for fact in facts if fact.believed} == {()}


def test_a_condition_that_nobody_confirms_makes_no_limit_weaker() -> None:
    wet = Scripted(lambda q, n: says("limit:80"), lambda q, n: says("plate:when_wet:de"))
    facts = drive_past(FrontEnd(wet, reader_backend=Scripted(lambda q, n: NO_ANSWER), home="DEU"))
    assert grounding.UNCONFIRMED in {fact.grounding for fact in facts}
    assert {fact.scope for fact in facts} == {"permanent"}


def test_a_backend_that_ignores_pictures_leaves_the_sign_reader_alone() -> None:
    facts = drive_past(FrontEnd(liar("limit:130"), reader_backend=seer("limit:80"), home="DEU"))
    assert may_raise(facts) == {"limit:80"}
    assert facts[-1].grounding == f"{grounding.ALONE}: {grounding.BLIND}"


def test_a_silent_backend_leaves_the_sign_reader_alone() -> None:
    facts = drive_past(beside("other", "limit:80"))
    assert may_raise(facts) == {"limit:80"}


def test_a_limit_too_high_for_the_road_of_the_map_is_held() -> None:
    front = beside("limit:130", "limit:130")
    front.here = front.here._replace(road_class="urban")
    facts = drive_past(front)
    assert believed(facts) == set()
    assert "the map says urban" in facts[-1].grounding
    free = beside("limit:130", "limit:130")
    free.here = free.here._replace(road_class="motorway")
    assert may_raise(drive_past(free)) == {"limit:130"}


def test_a_held_border_changes_no_country() -> None:
    front = beside("border:GBR", "limit:80")
    drive_past(front, size_m=0.9)
    assert front.country_belief.believed == "DEU"


def test_nothing_is_remembered_of_tracks_that_are_gone() -> None:
    front = beside("limit:130", "limit:80")
    drive_past(front)
    assert not front.backend_tracks
    assert not front.guard.grounds


LABELS = ["limit:30", "limit:50", "limit:80", "limit:130", "limit_end", "stop", "town_exit:yellow", "other", "zone:30"]


def _raises(fact: Fact) -> bool:
    return fact.believed and fact.confidence >= 0.6


@given(
    said=st.lists(st.sampled_from(LABELS), min_size=1, max_size=6),
    read=st.sampled_from(LABELS),
    plate=st.sampled_from(["other", "plate:when_wet:de", "plate:end", "plate:distance"]),
    road=st.sampled_from(["", "urban", "rural", "motorway"]),
)
@settings(max_examples=120, deadline=None, derandomize=True)
def test_beside_a_sign_reader_nothing_may_raise_that_the_reader_alone_would_not_raise_by(
    said: list[str], read: str, plate: str, road: str
) -> None:
    turn = iter(range(100_000))
    backend = Scripted(lambda q, n: says(said[next(turn) % len(said)]), lambda q, n: says(plate))
    front = FrontEnd(backend, reader_backend=seer(read), home="DEU")
    front.here = front.here._replace(road_class=road)
    alone = {(fact.reading, fact.scope) for fact in drive_past(FrontEnd(seer(read), home="DEU")) if _raises(fact)}
    facts = drive_past(front)
    assert {(fact.reading, fact.scope) for fact in facts if _raises(fact)} <= alone
    assert all(fact.grounding for fact in facts if not _raises(fact) and fact.reading == read and fact.confidence > 0.9)


def test_the_trace_of_a_tick_says_why_a_limit_was_held() -> None:
    drive, reasons = Drive(), set()
    for fact in drive_past(beside("limit:130", "limit:80")):
        _, seen, ticked = _ticked(drive, fact)
        said = trace_of(ticked, seen, {}, ticked.advisory, whole=False).inputs["facts"][0]["message"]["facts"][0]
        assert said["believed"] or said["grounding"]
        reasons.add(said["grounding"])
    assert {"the sign reader reads limit:80", "the backend reads limit:130"} <= reasons


def _ticked(drive: Drive, fact: Fact) -> tuple[State, Observations, Ticked]:
    drive.tick(fact)
    return drive.history[-1]


@pytest.mark.parametrize(
    ("label", "read"), [("limit:130", "limit:50"), ("limit:30", "limit:130"), ("stop", "limit:80")]
)
def test_a_held_limit_raises_no_target(label: str, read: str) -> None:
    drive = Drive()
    drive.tick(limit_sign("limit:50"))
    before = drive.target_mps
    for fact in drive_past(beside(label, read)):
        drive.tick(fact)
        assert drive.target_mps <= before + 1e-9


def test_every_targeted_question_has_a_kind() -> None:
    assert set(KIND_OF_QUESTION.values()) == {"sign", "plate", "panel", "light"}
