"""Numbers on plates: large letters only, in agreement only, and nothing waits for them."""

import threading
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from functools import partial
from typing import Any

import numpy as np
import pytest

from proto.scene import Fact
from services.drivelm.front_end import FrontEnd, Sighting
from services.drivelm.ocr.engine import Engine
from services.drivelm.ocr.lettering import Lettering
from services.drivelm.ocr.plate_numbers import HOURS
from services.drivelm.ocr.plate_reading import MOST_ASKED, PAUSE_NS, PlateNumbers, Read, agreed, read
from services.drivelm.reading import plates
from services.drivelm.reading.crops import Picture, Region
from tests.unit.services.drivelm.approach import NS, PICTURE, TELE, Scripted, box_at, says
from tests.unit.services.drivelm.ocr.test_plate_text import plate

KEY = ("tele", 7)
LARGE = plate("22-6 h", 90)


class AtOnce(Executor):
    """Does what it is given at once."""

    def submit(self, fn: Callable[..., Any], /, *args: Any, **kwargs: Any) -> Future[Any]:
        done: Future[Any] = Future()
        try:
            done.set_result(fn(*args, **kwargs))
        except RuntimeError as error:
            done.set_exception(error)
        return done


def reader(*texts: str, score: float = 0.99) -> PlateNumbers:
    """Reads these texts one after the other, the last one for ever."""
    left = list(texts)
    return PlateNumbers(lambda image: (left.pop(0) if len(left) > 1 else left[0], score), AtOnce())


def after(numbers: PlateNumbers, looks: int, picture: Picture = LARGE, pause_ns: int = PAUSE_NS) -> str:
    for step in range(looks):
        numbers.look(KEY, HOURS, picture, NS + step * pause_ns)
    return numbers.number(KEY, HOURS)


def test_two_pictures_that_agree_are_believed_and_one_is_not() -> None:
    assert after(reader("22-6 h"), 1) == ""
    assert after(reader("22-6 h"), 2) == "22-6 h"


def test_two_that_contradict_each_other_leave_the_plate_unread_for_good() -> None:
    assert after(reader("22-6 h", "22-8 h", "22-6 h"), 6) == ""


def test_what_is_not_read_neither_adds_nor_breaks() -> None:
    assert after(reader("22-6 h", "Blah", "", "22-6 h"), 4) == "22-6 h"


def test_an_unsure_text_is_none() -> None:
    assert after(reader("22-6 h", score=0.85), 6) == ""


def test_small_letters_are_not_tried() -> None:
    assert read(HOURS, plate("22-6 h", 36), lambda image: ("22-6 h", 1.0)).number == ""
    large = read(HOURS, LARGE, lambda image: ("22-6 h", 1.0))
    assert (large.number, large.text_px > 16) == ("22-6 h", True)


def test_the_same_instant_counts_once_and_a_plate_is_not_tried_for_ever() -> None:
    assert after(reader("22-6 h"), 5, pause_ns=PAUSE_NS // 10) == ""
    asked: list[Picture] = []

    def recognise(image: Picture) -> tuple[str, float]:
        asked.append(image)
        return "", 0.0

    after(PlateNumbers(recognise, AtOnce()), 50)
    assert len(asked) == MOST_ASKED


def test_another_kind_of_plate_and_a_forgotten_track_have_no_number() -> None:
    numbers = reader("22-6 h")
    assert after(numbers, 2)
    assert numbers.number(KEY, "plate:distance") == ""
    numbers.forget(KEY)
    assert numbers.number(KEY, HOURS) == ""


def test_looking_waits_for_nothing() -> None:
    go, thread = threading.Event(), ThreadPoolExecutor(1)
    numbers = PlateNumbers(lambda image: ("22-6 h" if go.wait(5) else "", 0.99), thread)
    assert after(numbers, 5) == ""
    go.set()
    thread.shutdown(wait=True)
    assert numbers.number(KEY, HOURS) == "", "one is not enough: nothing else was asked meanwhile"


def test_a_failing_recogniser_is_silence() -> None:
    def broken(image: Picture) -> tuple[str, float]:
        raise RuntimeError("no model")

    assert after(PlateNumbers(broken, AtOnce()), 4) == ""


def test_agreement_is_of_all_that_was_read() -> None:
    assert agreed([]) == agreed([Read("200 m", 12)]) == agreed([Read("200 m"), Read("200 m"), Read("300 m")]) == ""
    assert agreed([Read(), Read("200 m"), Read("200 m")]) == "200 m"


def seen(numbers: PlateNumbers, hung: str = HOURS) -> list[Fact]:
    """Six pictures of a limit with a plate below it."""
    backend = Scripted(lambda q, n: says("limit:80"), lambda q, n: says(hung))
    end = FrontEnd(backend, home="DEU", lettering=Lettering(None, numbers))
    facts: list[Fact] = []
    for step in range(6):
        box = box_at(10.0 - step / 10, -0.5)
        region = plates.split(Region(box.x0_px, box.y0_px, box.x1_px, box.y1_px))[1]
        picture, drawn = PICTURE.copy(), plate("22-6 h", round(region.width_px))
        top, left = round(region.y0_px), round(region.x0_px)
        shown = picture[top : top + drawn.shape[0], left : left + drawn.shape[1]]
        shown[:] = drawn[: shown.shape[0], : shown.shape[1]]
        sighting = Sighting(
            camera="tele",
            stamp_ns=NS + step * NS // 5,
            boxes=(box,),
            open_picture=partial(np.copy, picture),
            calibration=TELE,
        )
        facts += end.see(sighting)
    return facts


def test_the_number_stands_in_the_fact_of_its_sign_once_it_is_believed() -> None:
    facts = seen(reader("22-6 h"))
    assert facts[-1].plates == ("plate:time:22-6 h",)
    assert facts[-1].value == 80
    assert ("plate:time",) in {fact.plates for fact in facts}, "until then it is a plate with some hours"


def test_an_unread_plate_stays_what_it_is() -> None:
    assert seen(reader("22-6 h", "22-8 h"))[-1].plates == ("plate:time",)
    assert seen(reader("22-6 h"), "plate:lorries")[-1].plates == ("plate:lorries",)


def test_the_recogniser_reads_a_drawn_plate_and_not_half_of_it() -> None:
    pytest.importorskip("rapidocr")
    line, hidden = Engine().line, LARGE.copy()
    assert read(HOURS, LARGE, line).number == "22-6 h"
    hidden[:, :24] = 60
    assert read(HOURS, hidden, line).number == ""


def test_a_picture_of_nothing_is_not_read() -> None:
    assert after(reader("22-6 h"), 6, np.zeros((60, 100, 3), np.uint8)) == ""
