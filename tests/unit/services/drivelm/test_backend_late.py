"""A slow backend never holds anything up: few are asked at once, the newest first, and answers count with their picture's stamp."""

import threading
from collections.abc import Callable, Iterator, Sequence

import numpy as np
import pytest

from services.drivelm.backends.abstentions import UNMEASURED
from services.drivelm.backends.backend import NO_ANSWER, Answer
from services.drivelm.backends.background_worker import MOST_WAITING, BackgroundWorker, PendingQuestion
from services.drivelm.front_end import Sighting
from services.drivelm.late_front_end import AGREED, AGREEING, CHANGES_NS, VIEW_PX, Agreement, LateFrontEnd, view
from services.drivelm.reading.crops import Picture, Region
from services.drivelm.vocabulary.classes import QUESTIONS, SENTENCES
from tests.unit.services.drivelm.approach import NS, PICTURE, TELE, Scripted, box_at, says

SPOT = np.zeros((4, 4, 3), np.uint8)
WAIT_S = 5.0


class Slow:
    """A backend that answers only when it is let, and notes what it was asked, in order."""

    name, prompts = "slow", "abc"

    sees = True

    def __init__(self, answer: Answer) -> None:
        self.given, self.let, self.asked = answer, threading.Semaphore(0), list[tuple[tuple[int, ...], str]]()
        self.running = self.most_running = 0
        self._changed = threading.Condition()

    def answer(self, images: Sequence[Picture], question: str) -> Sequence[Answer]:
        with self._changed:
            self.asked.append((images[0].shape, question))
            self.running += 1
            self.most_running = max(self.most_running, self.running)
            self._changed.notify_all()
        assert self.let.acquire(timeout=WAIT_S)
        with self._changed:
            self.running -= 1
        if self.given.text == "fail":
            raise RuntimeError("a broken backend")
        return [self.given] * len(images)

    def free(self, image: Picture | None, prompt: str) -> tuple[str, float]:
        raise AssertionError("no whole prompt is asked here")

    def wait_asked(self, count: int) -> None:
        with self._changed:
            assert self._changed.wait_for(lambda: len(self.asked) >= count, WAIT_S)


class Bell:
    """Counts how often the runner called."""

    def __init__(self) -> None:
        self.rung = threading.Semaphore(0)

    def __call__(self) -> None:
        self.rung.release()

    def wait(self, count: int = 1) -> None:
        for _ in range(count):
            assert self.rung.acquire(timeout=WAIT_S)


def _pending(topic: str, stamp_ns: int) -> PendingQuestion[str]:
    return PendingQuestion(
        topic=(topic,), stamp_ns=stamp_ns, images=lambda: [SPOT], question="?", subject=f"{topic}@{stamp_ns}"
    )


def _worker(backend: Slow, bell: Bell, outstanding: int = 1, max_age_ns: int = 100) -> BackgroundWorker[str]:
    return BackgroundWorker(backend, outstanding=outstanding, max_age_ns=max_age_ns, ready=bell)


def _done(worker: BackgroundWorker[str]) -> list[str]:
    return [pending.subject for pending, _ in worker.collect()]


def test_no_more_are_outstanding_than_allowed() -> None:
    backend, bell = Slow(Answer("x", 0.9)), Bell()
    worker = _worker(backend, bell, outstanding=2)
    for number in range(6):
        worker.send(_pending(f"t{number}", number))
    backend.wait_asked(2)
    assert (len(backend.asked), worker.collect()) == (2, [])
    backend.let.release(6)
    bell.wait(6)
    assert backend.most_running == 2
    assert len(_done(worker)) == 6
    worker.close()
    backend.let.release(100)


def test_the_newest_picture_is_asked_first_and_replaces_older_ones_of_the_same_thing() -> None:
    backend, bell = Slow(Answer("x", 0.9)), Bell()
    worker = _worker(backend, bell)
    worker.send(_pending("first", 1))
    backend.wait_asked(1)
    for topic, stamp_ns in (("a", 10), ("b", 20), ("a", 30), ("c", 30)):
        worker.send(_pending(topic, stamp_ns))
    order = []
    for _ in range(4):
        backend.let.release()
        bell.wait()
        order += _done(worker)
    assert order == ["first@1", "a@30", "c@30", "b@20"]
    worker.close()
    backend.let.release(100)


def test_what_is_too_old_is_not_asked_and_no_heap_grows() -> None:
    backend, bell = Slow(Answer("x", 0.9)), Bell()
    worker = _worker(backend, bell, max_age_ns=100)
    worker.send(_pending("first", 1))
    backend.wait_asked(1)
    worker.send(_pending("old", 10))
    for number in range(MOST_WAITING + 10):
        worker.send(_pending(f"t{number}", 500 + number))
    backend.let.release(MOST_WAITING + 1)
    bell.wait(MOST_WAITING + 1)
    done = _done(worker)
    assert len(done) == MOST_WAITING + 1
    assert "old@10" not in done
    worker.close()
    backend.let.release(100)


def test_a_backend_that_breaks_is_an_abstention_and_the_next_is_asked() -> None:
    backend, bell = Slow(Answer("fail", 0.9)), Bell()
    worker = _worker(backend, bell)
    for number in range(2):
        worker.send(_pending(f"t{number}", number))
        backend.let.release()
        bell.wait()
    assert [answers for _, answers in worker.collect()] == [[NO_ANSWER], [NO_ANSWER]]
    worker.close()
    backend.let.release(100)


def test_pictures_that_cannot_be_made_are_an_abstention_and_those_of_replaced_questions_are_never_made() -> None:
    backend, bell, made = Slow(Answer("x", 0.9)), Bell(), list[int]()

    def pending(number: int) -> PendingQuestion[str]:
        def images() -> list[Picture]:
            made.append(number)
            return [SPOT] if number == 0 else []

        return PendingQuestion(topic=("t",), stamp_ns=number, images=images, question="?", subject=str(number))

    worker = _worker(backend, bell)
    worker.send(pending(0))
    backend.wait_asked(1)
    for number in (1, 2, 3):
        worker.send(pending(number))
    backend.let.release()
    bell.wait(2)
    assert [answers for _, answers in worker.collect()] == [[Answer("x", 0.9)], [NO_ANSWER]]
    assert made == [0, 3]
    worker.close()


def test_after_closing_nothing_more_is_asked_or_heard() -> None:
    backend, bell = Slow(Answer("x", 0.9)), Bell()
    worker = _worker(backend, bell)
    worker.send(_pending("a", 1))
    backend.wait_asked(1)
    worker.send(_pending("b", 2))
    worker.close()
    backend.let.release(100)
    backend.let.release()
    assert not bell.rung.acquire(timeout=0.05)
    assert worker.collect() == []
    assert len(backend.asked) == 1


def test_agreement_takes_several_in_a_row() -> None:
    agreement, plain = Agreement(), Answer("a", UNMEASURED, measured=False)
    first = [agreement.weighed(("t",), plain).score for _ in range(AGREEING)]
    assert first == [UNMEASURED] * (AGREEING - 1) + [AGREED]
    assert agreement.weighed(("t",), plain._replace(text="b")).score == UNMEASURED
    assert agreement.weighed(("t",), NO_ANSWER) == NO_ANSWER
    assert agreement.weighed(("t",), plain).score == UNMEASURED
    assert agreement.weighed(("other",), plain).score == UNMEASURED
    measured = Answer("a", 0.6)
    assert [agreement.weighed(("m",), measured).score for _ in range(5)] == [0.6] * 5


def test_a_view_keeps_proportions_and_is_large() -> None:
    seen = view(PICTURE, Region(100, 100, 110, 130))
    assert seen is not None
    assert seen.shape == (VIEW_PX, round(VIEW_PX / 3), 3)
    assert view(PICTURE, Region(-50, 0, -10, 40)) is None


class Drive:
    """Sees one thing again and again with a slow backend and a sign reader that sees something itself, or nothing."""

    def __init__(self, answer: Answer, *, read: str = "other", kind: str = "sign") -> None:
        self.backend, self.bell, self.stamp_ns, self.kind = Slow(answer), Bell(), NS, kind
        self.reader = Scripted(lambda question, number: says(read, 0.95))
        self.end = LateFrontEnd(self.backend, self.reader, home="DEU", outstanding=1)
        self.end.worker.ready = self.bell

    def see(self, distance_m: float = 30.0) -> None:
        box = box_at(distance_m, -3.5, kind=self.kind)  # type: ignore[arg-type]
        sighting = Sighting(
            camera="tele", stamp_ns=self.stamp_ns, boxes=(box,), open_picture=lambda: PICTURE, calibration=TELE
        )
        self.said = self.end.see(sighting)
        self.stamp_ns += NS // 5

    def let(self, count: int = 1) -> None:
        self.backend.let.release(count)
        self.bell.wait(count)
        self.end.arrive()

    def see_and_hear(self) -> None:
        """One picture, and the answers to its two questions: the sign's and its plate's."""
        self.see()
        self.let(2)

    @property
    def heard(self) -> str:
        heard = self.end.backend_tracks.get(("tele", 7))
        return "" if heard is None else heard.belief().reading


Begin = Callable[..., Drive]


@pytest.fixture
def begin() -> Iterator[Begin]:
    """Begins drives, and lets their threads go at the end."""
    begun: list[Drive] = []

    def start(answer: Answer, **options: str) -> Drive:
        begun.append(Drive(answer, **options))
        return begun[-1]

    yield start
    for drive in begun:
        drive.end.worker.close()
        drive.backend.let.release(100)


def test_a_picture_is_seen_without_waiting_and_its_answer_counts_when_it_comes(begin: Begin) -> None:
    drive = begin(says("limit:80", 0.95))
    drive.see()
    drive.backend.wait_asked(1)
    for _ in range(4):
        drive.see()  # returns although the backend has let nothing go
    assert drive.heard == ""
    drive.let()
    assert drive.heard == "limit:80"
    assert drive.end.backend_tracks["tele", 7].seen_ns == NS


def test_what_the_backend_believes_is_said_with_the_stamp_of_its_picture(begin: Begin) -> None:
    drive = begin(says("limit:80", 0.97))
    for _ in range(8):
        drive.see_and_hear()
    answered_ns = drive.end.backend_tracks["tele", 7].seen_ns
    drive.stamp_ns += NS
    drive.see()
    facts = [fact for fact in drive.said if fact.reading == "limit:80"]
    assert facts
    assert {fact.frame_stamp_ns for fact in facts} == {answered_ns}
    assert answered_ns < drive.stamp_ns - NS


def test_an_answer_for_a_track_that_is_gone_is_dropped(begin: Begin) -> None:
    drive = begin(says("limit:80", 0.97))
    drive.see()
    drive.backend.wait_asked(1)
    drive.end.settle(drive.stamp_ns + 20 * NS, 15.0)
    assert not drive.end.tracks
    drive.let()
    assert drive.heard == ""


def test_an_answer_about_what_the_track_was_before_it_became_another_thing_is_dropped(begin: Begin) -> None:
    drive = begin(says("limit:80", 0.97))
    drive.see()
    drive.backend.wait_asked(1)
    drive.end.settle(drive.stamp_ns + 20 * NS, 15.0)
    drive.stamp_ns += 21 * NS
    drive.see()  # the same number, another thing
    drive.let()
    assert drive.heard == ""


@pytest.mark.parametrize(("late_ns", "counts"), [(CHANGES_NS // 2, True), (CHANGES_NS * 2, False)])
def test_an_old_answer_about_a_light_tells_nothing(late_ns: int, counts: bool, begin: Begin) -> None:
    drive = begin(says("light:green", 0.97), read="light:red", kind="light")
    drive.see()
    drive.backend.wait_asked(1)
    drive.stamp_ns = NS + late_ns
    drive.see()
    drive.let()
    assert (drive.heard == "light:green") is counts
    drive.stamp_ns += 2 * CHANGES_NS
    drive.see()
    assert drive.heard == ""  # and what was heard is forgotten when it grows old
    assert not [fact for fact in drive.said if fact.reading == "light:green" and fact.believed]


def test_the_backend_is_asked_both_questions_with_a_large_picture(begin: Begin) -> None:
    drive = begin(says("limit:80", 0.95))
    drive.see(20.0)
    drive.backend.wait_asked(1)
    drive.let()
    drive.backend.wait_asked(2)
    drive.let()
    assert {question for _, question in drive.backend.asked} == {QUESTIONS["sign"], QUESTIONS["plate"]}
    assert all(max(shape) == VIEW_PX for shape, _ in drive.backend.asked)


def test_three_agreeing_answers_without_probabilities_are_needed_before_any_counts_as_clear(begin: Begin) -> None:
    drive = begin(Answer(SENTENCES["stop"], UNMEASURED, measured=False))
    clear = []
    for _ in range(AGREEING + 1):
        drive.see_and_hear()
        clear.append(drive.end.backend_tracks["tele", 7].belief().clear_frames)
    assert clear[: AGREEING - 1] == [0.0] * (AGREEING - 1)
    assert clear[-1] == 2.0
