"""What a driver hears of an intervention."""

from hypothesis import given
from hypothesis import strategies as st

from domain.hearing import ACT_PAUSE_S, Hearing

TICK_NS = 100_000_000


def test_an_intervention_is_heard_once_and_again_for_another_hazard() -> None:
    hears = Hearing().hears
    told = ["closing_lead"] * 3 + ["pedestrian"] + ["caution"] + ["closing_lead"] * 2
    assert [hears("ACT", about, n * TICK_NS) for n, about in enumerate(told)] == [
        True, False, False, True, False, False, False,
    ]  # fmt: skip


def test_one_that_pauses_is_another() -> None:
    hears = Hearing().hears
    later_ns = round(ACT_PAUSE_S * 1e9)
    assert [hears("ACT", "pedestrian", at) for at in (0, later_ns - 1, 2 * later_ns - 1)] == [True, False, True]


@given(st.lists(st.tuples(st.sampled_from(["SILENT", "SPEAK", "ACT"]), st.sampled_from("abc"), st.integers(-9, 9))))
def test_every_word_is_heard_and_no_silence(ticks: list[tuple[str, str, int]]) -> None:
    hears = Hearing().hears
    heard = [hears(kind, about, at * TICK_NS) for kind, about, at in ticks]
    assert all(told == (kind == "SPEAK") for (kind, _, _), told in zip(ticks, heard, strict=True) if kind != "ACT")
    acts = [told for (kind, _, _), told in zip(ticks, heard, strict=True) if kind == "ACT"]
    assert not acts or acts[0], "the first of an intervention is heard, whatever the clock does"
