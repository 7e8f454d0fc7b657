"""What a driver hears of an intervention."""

from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st

from domain.hearing import ACT_PAUSE_S, REPEAT_S, WORDS_S, Hearing

TICK_NS = 100_000_000


class Said(NamedTuple):
    """An advisory."""

    kind: str
    hazard: str = ""
    urgency: str = "alarm"
    topic: str = ""


def test_an_intervention_is_heard_once_and_again_for_another_hazard() -> None:
    hears = Hearing().hears
    told = ["closing_lead"] * 3 + ["pedestrian"] + ["caution"] + ["closing_lead"] * 2
    assert [hears(Said("ACT", about), n * TICK_NS) for n, about in enumerate(told)] == [
        True, False, False, True, False, False, False,
    ]  # fmt: skip


def test_one_that_pauses_is_another() -> None:
    hears, later_ns = Hearing().hears, round(ACT_PAUSE_S * 1e9)
    act = Said("ACT", "pedestrian")
    assert [hears(act, at) for at in (0, later_ns - 1, 2 * later_ns - 1)] == [True, False, True]


def test_the_alarm_that_was_just_spoken_is_not_said_again_as_the_car_brakes() -> None:
    for alarm, act, seconds, heard in (
        (Said("SPEAK", "pedestrian"), "pedestrian", 0.7 * WORDS_S, False),
        (Said("SPEAK", "pedestrian"), "pedestrian", WORDS_S, True),
        (Said("SPEAK", "pedestrian"), "closing_lead", 0.7 * WORDS_S, True),
        (Said("SPEAK", "pedestrian", "warning"), "pedestrian", 0.7 * WORDS_S, True),
    ):
        hears = Hearing().hears
        assert hears(alarm, 0)
        assert hears(Said("ACT", act), round(seconds * 1e9)) is heard


def test_an_intervention_that_lasts_is_said_again_in_its_time() -> None:
    hears = Hearing().hears
    heard = [n for n in range(100) if hears(Said("ACT", "held"), n * TICK_NS)]
    assert heard == [0, 40, 80]
    assert REPEAT_S == 4.0


def test_a_caution_is_heard_where_the_intervention_has_named_nothing() -> None:
    for before in (None, Said("SPEAK", "vehicle_fault"), Said("SPEAK", "", "alarm", "vehicle")):
        hears = Hearing().hears
        if before is not None:
            hears(before, 0)
        assert hears(Said("ACT", "caution"), TICK_NS)


def test_an_intervention_begins_whether_its_words_are_spoken_or_not() -> None:
    hearing = Hearing()
    told = [Said("SPEAK", "pedestrian"), *[Said("ACT", "pedestrian")] * 3, Said("SILENT")]
    begun = [(hearing.hears(each, n * TICK_NS), hearing.begins) for n, each in enumerate(told)]
    assert begun == [(True, False), (False, True), (False, False), (False, False), (False, False)]


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["SILENT", "SPEAK", "ACT"]), st.sampled_from(["a", "b", "caution"]), st.sampled_from(["warning", "alarm"]),
            st.integers(-9, 9),
        )
    )
)  # fmt: skip
def test_every_word_is_heard_no_silence_and_of_the_first_intervention_the_alarm_or_the_act(
    ticks: list[tuple[str, str, str, int]],
) -> None:
    hears = Hearing().hears
    heard = [hears(Said(kind, about, urgency), at * TICK_NS) for kind, about, urgency, at in ticks]
    for n, (kind, about, _, _) in enumerate(ticks):
        if kind != "ACT":
            assert heard[n] == (kind == "SPEAK")
        elif about != "caution":
            assert any(told and other[1] == about for told, other in zip(heard[: n + 1], ticks, strict=False))
