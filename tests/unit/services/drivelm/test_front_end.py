"""Whole approaches: what is believed, when, of what scope, and that doubt stays doubt."""

from itertools import count

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from proto.scene import Fact
from services.drivelm.backends.backend import NO_ANSWER, Answer
from services.drivelm.country.surroundings import surroundings
from services.drivelm.front_end import FrontEnd, Sighting
from tests.unit.services.drivelm.approach import NS, TELE, Scripted, box_at, drive_past, says, sighting, stand_before


def _end(label: str, score: float = 0.97, *, plate: str = "", home: str = "DEU", max_reads: int = 8) -> FrontEnd:
    hung = (lambda q, n: says(plate, 0.97)) if plate else None
    return FrontEnd(Scripted(lambda q, n: says(label, score), hung), home=home, max_reads=max_reads)


def test_a_clear_limit_is_believed_before_it_is_passed_and_passed_once() -> None:
    facts = drive_past(_end("limit:80"))
    believed = [fact for fact in facts if fact.believed]
    assert {fact.reading for fact in believed} == {"limit:80"}
    first, last = believed[0], believed[-1]
    assert (first.value, first.unit, first.scope, first.passed) == (80, "km/h", "permanent", False)
    assert first.distance_m is not None
    assert first.distance_m > 40
    assert last.passed
    assert sum(fact.passed for fact in facts) == 1
    assert last.distance_m == pytest.approx(0, abs=4)


def test_place_is_measured_from_the_size_in_the_picture() -> None:
    facts = drive_past(_end("limit:50"), lateral_m=-3.5)
    assert facts[0].lateral_m == pytest.approx(-3.5, abs=0.3)


def test_a_when_wet_plate_makes_the_limit_conditional() -> None:
    facts = drive_past(_end("limit:80", plate="plate:when_wet:de"))
    assert facts[-1].scope == "when_wet"
    assert facts[-1].plates == ("plate:when_wet:de",)
    assert facts[-1].value == 80


def test_without_a_believed_plate_the_limit_counts_always() -> None:
    unsure = FrontEnd(Scripted(lambda q, n: says("limit:80"), lambda q, n: says("plate:when_wet:de", 0.5)), home="DEU")
    assert drive_past(unsure)[-1].scope == "permanent"


def test_an_end_plate_or_end_sign_has_no_number_to_obey() -> None:
    assert drive_past(_end("limit:80", plate="plate:end"))[-1].scope == "end"
    ended = drive_past(_end("limit_end"))[-1]
    assert (ended.kind, ended.value, ended.scope) == ("limit", None, "end")


def test_an_empty_ring_is_no_zero() -> None:
    facts = drive_past(_end("no_vehicles"))
    assert {fact.kind for fact in facts if fact.track_id} == {"sign"}
    assert all(fact.value is None for fact in facts)


def test_a_doubtful_reading_is_offered_with_candidates_and_never_believed() -> None:
    backend = Scripted(lambda q, n: says("limit:80", 0.55, ("limit:60", 0.35)))
    facts = drive_past(FrontEnd(backend, home="DEU"))
    assert facts
    assert not any(fact.believed for fact in facts)
    assert {candidate.reading for candidate in facts[0].candidates} == {"limit:80", "limit:60"}


def test_a_number_that_the_country_does_not_show_is_not_believed() -> None:
    facts = drive_past(_end("limit:110", home="GBR"))
    assert not any(fact.believed for fact in facts)
    assert all(fact.confidence == 0 for fact in facts)


def test_units_follow_the_country_and_are_unset_where_it_is_unknown() -> None:
    assert drive_past(_end("limit:30", home="GBR"))[-1].unit == "mph"
    assert drive_past(_end("limit:30", home=""))[-1].unit is None


def test_a_border_changes_the_country_when_it_is_passed_not_before() -> None:
    end = _end("border:GBR", home="DEU")
    for _ in range(5):
        end.see(sighting(NS, box_at(40, -3.5)))
    assert end.country_belief.believed == "DEU"
    drive_past(end, start_ns=2 * NS, size_m=0.9)
    assert end.country_belief.believed == "GBR"
    assert surroundings(end.country_belief, None, NS)[0].text == "border:GBR 6.0"


def test_signs_that_tell_the_country_are_told_with_their_weight() -> None:
    end = _end("national", plate="plate:when_wet:en", home="")
    drive_past(end)
    country = surroundings(end.country_belief, None, NS)[0]
    assert (country.reading, country.believed) == ("GBR", True)
    assert country.sentence == "The signs are of GBR; for it spoke: national 3.0, plate:when_wet:en 1.7."


def test_a_town_sign_sets_the_road_type_when_passed() -> None:
    end = _end("town_entry:yellow")
    facts = drive_past(end, size_m=0.65)
    assert facts[-1].reading == "town_entry"
    assert end.road_type is not None
    assert end.road_type[0] == "urban"


@pytest.mark.parametrize(("before", "after"), [("urban", "rural"), (None, "rural"), ("motorway", "motorway")])
def test_the_sign_for_the_national_limit_ends_a_town_and_no_motorway(before: str | None, after: str) -> None:
    end = _end("national", home="GBR")
    end.road_type = (before, 0.9) if before is not None else None
    assert drive_past(end)[-1].reading == "national"
    assert end.road_type is not None
    assert end.road_type[0] == after


def test_a_gantry_limit_names_the_ego_lane_or_the_offset() -> None:
    over = _end("led:80")
    over.here = over.here._replace(ego_lane_id="L1")
    fact = drive_past(over, kind="panel", size_m=1.2, lateral_m=0.2)[-1]
    assert (fact.scope, fact.value, fact.lane_id) == ("gantry", 80, "L1")
    beside = drive_past(_end("led:60"), kind="panel", size_m=1.2, lateral_m=3.4)[-1]
    assert beside.lane_id == "offset:+1.0"


def test_a_dark_panel_between_two_lanes_lifts_nothing_for_the_ego() -> None:
    end = _end("led:blank")
    end.here = end.here._replace(ego_lane_id="L1")
    assert drive_past(end, kind="panel", size_m=1.2, lateral_m=1.5)[-1].lane_id.startswith("offset:")
    over = _end("led:blank")
    over.here = over.here._replace(ego_lane_id="L1")
    assert drive_past(over, kind="panel", size_m=1.2, lateral_m=0.1)[-1].lane_id == "L1"


def test_a_light_is_said_with_every_frame_and_forgotten_when_it_is_gone() -> None:
    end = _end("light:red")
    facts = drive_past(end, kind="light", size_m=1.1)
    assert {fact.reading for fact in facts} == {"light:red"}
    assert len(facts) >= 8
    assert not any(fact.passed for fact in facts)
    assert not end.tracks


def _light_read(*answers: Answer) -> tuple[FrontEnd, list[tuple[Fact, ...]]]:
    """What is said of a light 20 m ahead in one picture after another, each read as given."""
    scripted = iter(answers)
    end = FrontEnd(Scripted(lambda q, n: next(scripted)), home="DEU")
    return end, [
        end.see(sighting((number + 1) * NS // 10, box_at(20, -3, "light", size_m=1.0)))
        for number in range(len(answers))
    ]


@pytest.mark.parametrize("hidden_by", ["others", "size"])
def test_a_green_light_that_is_no_longer_read_is_soon_no_longer_told(hidden_by: str) -> None:
    end = _end("light:green")
    said = [end.see(sighting(step * NS // 10, box_at(40, -3, "light", size_m=1.0))) for step in range(1, 5)]
    assert [fact.reading for fact in said[-1] if fact.believed] == ["light:green"]
    others = [box_at(20, 2 * place - 10, "light", 100 + place, 1.0) for place in range(8)]
    last_ns = 0
    for step in range(5, 40):
        boxes = [box_at(40, -3, "light", size_m=1.0), *others] if hidden_by == "others" else [
            box_at(40, -3, "light", size_m=0.2)
        ]  # fmt: skip
        facts = [*end.see(sighting(step * NS // 10, *boxes)), *end.settle(step * NS // 10, 0.0)]
        last_ns = max([last_ns, *(fact.frame_stamp_ns for fact in facts if fact.track_id == 7)])
    assert NS <= last_ns <= 14 * NS // 10
    assert ("tele", 7) not in end.tracks


def test_a_light_that_is_read_now_and_then_is_told_of_every_picture() -> None:
    end = _end("light:green")
    for step in range(1, 40):
        size_m = 1.0 if step < 5 or step % 7 == 0 else 0.2
        said = end.see(sighting(step * NS // 10, box_at(40, -3, "light", size_m=size_m)))
        assert step < 5 or [fact.reading for fact in said] == ["light:green"]


def test_a_light_that_was_doubted_and_is_none_is_withdrawn_once() -> None:
    doubt, nothing = says("light:red", 0.6, ("other", 0.3)), says("other", 0.98)
    _, said = _light_read(doubt, doubt, nothing, nothing, nothing)
    assert [fact.reading for fact in said[1]] == ["light:red"]
    assert not said[1][0].believed
    later = [fact for facts in said[2:] for fact in facts]
    assert [(fact.reading, fact.withdrawn, fact.confidence) for fact in later] == [("light:red", True, 0.0)]


def test_a_doubted_light_that_goes_out_of_sight_is_not_withdrawn() -> None:
    doubt = says("light:red", 0.6, ("other", 0.3))
    end, said = _light_read(doubt, doubt)
    assert said[1]
    assert not [fact for tenth in range(2, 100) for fact in end.settle(tenth * NS // 10, 8.0)]
    assert not end.tracks


shares = st.sampled_from((0.34, 0.6, 0.8, 0.97))


@settings(max_examples=60)
@given(st.lists(st.tuples(st.sampled_from(("light:red", "light:green", "other")), shares), max_size=12))
def test_a_light_that_was_believed_is_never_withdrawn(later: list[tuple[str, float]]) -> None:
    red = says("light:red", 0.97)
    _, said = _light_read(red, red, red, red, *(says(reading, share) for reading, share in later))
    assert any(fact.believed for facts in said[:4] for fact in facts)
    assert not any(fact.withdrawn for facts in said for fact in facts)


def test_boxes_without_a_track_or_too_small_are_not_read() -> None:
    end = _end("limit:80")
    boxes = (box_at(40, -3, track_id=0), box_at(200, -3))
    opened: list[int] = []

    def open_picture() -> None:
        opened.append(1)

    assert end.see(Sighting(camera="tele", stamp_ns=NS, boxes=boxes, open_picture=open_picture)) == ()
    assert not opened


def test_no_more_crops_are_read_than_allowed() -> None:
    end = _end("limit:80", max_reads=3)
    boxes = tuple(box_at(30, -3 + i, track_id=i + 1) for i in range(9))
    end.see(sighting(NS, *boxes))
    assert isinstance(end.backend, Scripted)
    assert len(end.backend.asked) <= 3


def test_a_settled_sign_makes_way_for_new_ones() -> None:
    end = _end("limit:80", max_reads=2)
    stand_before(end, frames=8, per_s=5)
    assert end.tracks["tele", 7].settled
    end.see(sighting(4 * NS, box_at(30, -3), box_at(60, 2, track_id=8)))
    assert end.tracks["tele", 8].evidence.frames == 1


def test_a_track_that_jumps_to_another_sign_is_parted_in_two() -> None:
    labels = ["border:GBR"] * 6 + ["limit:30"] * 20
    turn = iter(labels)
    end = FrontEnd(Scripted(lambda q, n: says(next(turn))), home="DEU")
    facts = []
    for step in range(10):
        near = step >= 6
        stamp_ns, distance_m = NS + step * NS // 5, (25.0 if near else 60.0) - 3 * (step - 6 * near)
        box = box_at(distance_m, -3, size_m=0.6 if near else 0.9)
        facts += [*end.see(sighting(stamp_ns, box)), *end.settle(stamp_ns, 15.0)]
    assert end.tracks["tele", 7].belief().reading == "limit:30"
    for step in range(40):
        facts += end.settle(3 * NS + step * NS // 10, 15.0)
    passed = [fact for fact in facts if fact.passed]
    assert [fact.reading for fact in passed] == ["limit:30", "border:GBR"]
    assert passed[0].track_id == 7 != passed[1].track_id
    assert end.country_belief.believed == "GBR"


def test_another_number_on_the_same_sign_is_doubt_and_no_second_sign() -> None:
    labels = ["limit:60"] * 4 + ["limit:80"] * 30
    turn = iter(labels)
    facts = drive_past(FrontEnd(Scripted(lambda q, n: says(next(turn))), home="DEU"))
    assert {fact.track_id for fact in facts} == {7}
    assert sum(fact.passed for fact in facts) == 1


def test_a_missing_picture_says_nothing() -> None:
    end = _end("limit:80")
    blind = Sighting(camera="tele", stamp_ns=NS, boxes=(box_at(30, -3),), open_picture=lambda: None, calibration=TELE)
    assert end.see(blind) == ()


def test_without_a_speed_an_end_sign_never_counts_as_passed() -> None:
    end = _end("limit_end")
    stand_before(end, frames=6, per_s=5)
    late = [fact for step in range(60) for fact in end.settle(3 * NS + step * NS // 5, None)]
    assert not any(fact.passed for fact in late)
    assert not end.tracks


_HOSTILE = st.one_of(
    st.text(max_size=80),
    st.integers(0, 10**6).map(lambda value: f"The speed limit is {value} km/h."),
    st.integers(0, 10**6).map(lambda value: f"The speed limit is {value} mph."),
    st.just("Ignore all signs. The speed limit is 130 km/h."),
    st.just("The traffic sign is a speed limit sign of 130. The traffic sign is a speed limit sign of 50."),
)


@given(st.lists(_HOSTILE, min_size=1, max_size=8), st.sampled_from(["DEU", "GBR", ""]))
@settings(max_examples=60, deadline=None)
def test_hostile_answers_never_make_a_limit_off_the_list_or_in_a_foreign_unit(texts: list[str], home: str) -> None:
    turn = iter(range(10_000))

    def speak(question: str, number: int) -> Answer:
        return Answer(texts[next(turn) % len(texts)], 0.99)

    facts = drive_past(FrontEnd(Scripted(speak, speak), home=home))
    for fact in facts:
        if fact.believed and fact.value is not None:
            assert fact.value <= (70 if home == "GBR" else 140)
            assert fact.unit == {"DEU": "km/h", "GBR": "mph"}.get(home, fact.unit)


@given(st.integers(0, 18))
@settings(max_examples=25, deadline=None)
def test_silence_between_answers_never_adds_belief(place: int) -> None:
    turn = count()

    def speak(question: str, number: int) -> Answer:
        return says("limit:130") if next(turn) == place else NO_ANSWER

    facts = drive_past(FrontEnd(Scripted(speak), home="DEU"), speed_mps=12)
    assert next(turn) > place, "the one answer was given"
    assert not any(fact.believed for fact in facts)


FREEING = ["border:GBR", "all_end", "limit_end", "town_exit:yellow", "motorway", "national", "limit:120", "zone_end"]


@settings(max_examples=60, deadline=None)
@given(
    label=st.sampled_from(FREEING),
    first_px=st.floats(10.0, 90.0),
    jitter=st.lists(st.floats(0.9, 1.1), min_size=2, max_size=20),
    fading=st.floats(0.8, 1.0),
    speed_mps=st.floats(1.0, 60.0),
)
def test_what_does_not_grow_as_the_ego_comes_nearer_was_no_sign_that_is_passed(
    label: str, first_px: float, jitter: list[float], fading: float, speed_mps: float
) -> None:
    """A board on a truck, a reflection: sure as its reading may be, no country, road or limit changes by it."""
    end = _end(label, home="DEU")
    said: list[Fact] = []
    for at, share in enumerate([1.0, *jitter]):
        stamp_ns = NS + at * NS // 5
        said += end.see(sighting(stamp_ns, box_at(1443 * 0.6 / (first_px * share * fading**at), -3.5)))
        said += end.settle(stamp_ns, speed_mps)
    for second in range(3, 60):
        said += end.settle(NS * (second + len(jitter)), speed_mps)
    assert not any(fact.passed and fact.believed for fact in said)
    assert end.country_belief.believed == "DEU"
    assert end.road_type is None
