"""Styles of signs: boards and rings, the units that follow from them, and the country that they tell of."""

from dataclasses import replace
from functools import partial

import cv2
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from proto.scene import Fact
from services.drivelm.country.country_belief import CountryBelief, cues_of
from services.drivelm.front_end import FrontEnd
from services.drivelm.reading import plates
from services.drivelm.reading.crops import Region
from services.drivelm.reading.facts import public_code
from services.drivelm.vocabulary.classes import ARROW_LIGHTS, BOARD_VALUES, LIMIT_VALUES, SCHOOL_VALUES
from services.drivelm.vocabulary.jurisdictions import JURISDICTIONS, unit_of_sign
from services.drivelm.vocabulary.parser import statement_of
from tests.unit.services.drivelm.approach import NS, Scripted, box_at, drive_past, says, sighting


def _last(label: str, home: str, plate: str = "other") -> Fact:
    end = FrontEnd(Scripted(lambda q, n: says(label), lambda q, n: says(plate, 0.97)), home=home)
    return drive_past(end)[-1]


def test_a_board_is_a_limit_in_miles_under_the_code_that_all_limits_have() -> None:
    fact = _last("limit_board:25", "USA")
    assert (fact.reading, fact.value, fact.unit, fact.scope) == ("limit:25", 25, "mph", "permanent")
    assert fact.believed
    assert "board" in fact.sentence


@pytest.mark.parametrize("value", [30, 50, 80])
def test_a_ring_where_boards_are_used_is_read_in_the_lower_unit(value: int) -> None:
    assert _last(f"limit:{value}", "USA").unit == "km/h"
    assert unit_of_sign("GBR", f"limit:{value}") == "mph"
    assert unit_of_sign(None, f"limit:{value}") is None


def test_a_school_limit_stands_beside_the_others_and_keeps_its_own_plates() -> None:
    fact = _last("school_limit:20", "USA", "plate:time")
    assert (fact.reading, fact.value) == ("limit:20", 20)
    assert fact.plates == ("plate:school", "plate:time")
    ended = _last("school_end", "USA")
    assert (ended.reading, ended.value, ended.scope) == ("school_end", None, "end")


def test_an_advised_speed_below_a_warning_is_no_limit() -> None:
    fact = _last("slippery", "USA", "plate:advisory")
    assert (fact.kind, fact.value, fact.plates) == ("sign", None, ("plate:advisory",))
    assert not [
        one for one in drive_past(FrontEnd(Scripted(lambda q, n: says("plate:advisory")), home="USA")) if one.track_id
    ]


def test_the_swiss_general_limit_is_a_limit_and_its_end_an_end() -> None:
    assert (_last("general:50", "CHE").reading, _last("general:50", "CHE").unit) == ("limit:50", "km/h")
    assert (_last("general_end", "CHE").reading, _last("general_end", "CHE").scope) == ("limit_end", "end")


def test_arrows_below_a_sign_are_said_with_it() -> None:
    for way in ("left", "right", "ahead"):
        assert _last("limit:50", "DEU", f"plate:arrow_{way}").plates == (f"plate:arrow_{way}",)


def test_every_arrow_light_is_a_light_with_its_way() -> None:
    assert len(ARROW_LIGHTS) == 9
    for label in ARROW_LIGHTS:
        assert statement_of(label).kind == "light"
        assert public_code(label) == label


def test_boards_move_the_belief_to_the_united_states_and_rings_away_from_them() -> None:
    abroad = CountryBelief.at_home("DEU")
    for number, value in enumerate((25, 35, 55)):
        abroad = abroad.with_cue(("tele", number), cues_of(f"limit_board:{value}"))
    assert abroad.believed == "USA"
    assert abroad.of_unit("mph") > 0.8
    assert cues_of("limit:50")["USA"] < 0
    assert "DEU" not in cues_of("limit:50")
    assert cues_of("limit_board:55")["GBR"] < 0
    once = CountryBelief.at_home("DEU").with_cue(("tele", 1), cues_of("limit_board:30"))
    assert once.believed != "USA", "one board is not enough"


@pytest.mark.parametrize(
    ("language", "countries"), [("pl", {"POL"}), ("de", {"DEU", "AUT", "CHE"}), ("en", {"GBR", "IRL", "USA"})]
)
def test_the_language_of_a_plate_tells_of_all_who_write_it(language: str, countries: set[str]) -> None:
    assert set(cues_of(f"plate:when_wet:{language}")) == countries


def test_a_home_is_believed_but_weakly_however_many_countries_there_are() -> None:
    for home in JURISDICTIONS:
        assert CountryBelief.at_home(home).posterior(home) == pytest.approx(0.816, abs=1e-3)


def test_readers_numbers_are_posted_somewhere() -> None:
    rings = frozenset.union(*(row.limits for row in JURISDICTIONS.values() if not row.boards))
    assert set(LIMIT_VALUES) <= rings
    assert set(BOARD_VALUES) | set(SCHOOL_VALUES) <= JURISDICTIONS["USA"].limits


@given(st.floats(0.5, 3.0))
def test_boards_are_parted_from_plates_by_their_height_where_there_are_boards(ratio: float) -> None:
    box = Region(0, 0, 100, 100 * ratio)
    own, hung = plates.split(box, boards=True)
    parted = plates.TALL_BOARD < ratio < plates.TALLEST_PAIR
    assert (own.height_px < box.height_px) == parted
    assert hung.y0_px >= own.y1_px


@pytest.mark.parametrize("ratio", [0.76 / 0.61, 1.07 / 0.61])
def test_the_boards_that_are_drawn_are_read_whole(ratio: float) -> None:
    box = Region(10, 10, 50, 10 + 40 * ratio)
    assert plates.split(box, boards=True)[0] == box


def _warned(end: FrontEnd, track_id: int, *, speed_mps: float | None) -> None:
    """A yellow diamond that nothing can be read on comes nearer, and is out of sight for long."""
    picture = np.full((360, 640, 3), (135, 170, 205), np.uint8)
    start_ns = track_id * 100 * NS
    for step in range(8):
        box = box_at(40.0 - 2.0 * step, -3.0, track_id=track_id, size_m=0.9)
        middle, half = ((box.x0_px + box.x1_px) / 2, (box.y0_px + box.y1_px) / 2), (box.x1_px - box.x0_px) / 2
        ways = ((0, -half), (half, 0), (0, half), (-half, 0))
        corners = np.array([(middle[0] + x, middle[1] + y) for x, y in ways], np.int32)
        seen = cv2.fillPoly(picture.copy(), [corners], (240, 190, 20))
        end.see(replace(sighting(start_ns + step * NS // 5, box), open_picture=partial(np.copy, seen)))
    for step in range(8, 80):
        end.settle(start_ns + step * NS // 5, speed_mps)


def test_yellow_diamonds_that_are_passed_tell_of_the_united_states_though_nothing_is_read_on_them() -> None:
    end = FrontEnd(Scripted(lambda q, n: says("other")), home="DEU")
    for track_id in range(1, 4):
        _warned(end, track_id, speed_mps=15.0)
    assert (end.country_belief.believed, end.country_belief.assumed) == ("USA", False)
    assert end.country_belief.evidence == (("diamond:yellow", 7.0),)


def test_yellow_diamonds_at_an_unknown_speed_end_the_home_setting_and_tell_no_country() -> None:
    end = FrontEnd(Scripted(lambda q, n: says("other")), home="DEU")
    for track_id in range(1, 6):
        _warned(end, track_id, speed_mps=None)
    assert end.country_belief.believed is None
