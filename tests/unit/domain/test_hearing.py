"""What a driver hears of an intervention."""

from typing import NamedTuple

from hypothesis import given
from hypothesis import strategies as st

from domain.hearing import ACT_PAUSE_S, WORDS_S, Hearing

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


@given(
    st.lists(
        st.tuples(
            st.sampled_from(["SILENT", "SPEAK", "ACT"]), st.sampled_from("abc"), st.sampled_from(["warning", "alarm"]),
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
        else:
            assert any(told and other[1] == about for told, other in zip(heard[: n + 1], ticks, strict=False))
