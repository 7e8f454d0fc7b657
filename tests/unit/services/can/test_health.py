"""Health as properties: more faults never heal, silence never heals, a sound car is exactly sound."""

from collections.abc import Mapping

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from services.can import health
from services.can.dtc import DtcBook
from services.can.health import Assessment, Held, assess
from services.can.indicators import BRAKES, LAMPS, TYRES, table

TABLE = table((2.4, 2.4, 2.6, 2.6))
SOUND: Mapping[str, float] = (
    dict.fromkeys(LAMPS, 0.0)
    | dict.fromkeys(BRAKES, 80.0)
    | dict(zip(TYRES, (2.4, 2.4, 2.6, 2.6), strict=True))
    | dict.fromkeys(
        (
            "abs_fault",
            "esc_fault",
            "esc_off",
            "brake_fluid_low",
            "brake_lining_worn",
            "brake_booster_fault",
            "steering_assist_fault",
        ),
        0.0,
    )
    | {
        "engine_running": 1.0,
        "coolant_temperature_c": 92.0,
        "oil_pressure_bar": 2.5,
        "fuel_share": 0.5,
        "battery_voltage_v": 14.0,
    }
)
# How each field gets worse.
WORSE: dict[str, tuple[float, float]] = (
    {name: (0.0, 1.0) for name, value in SOUND.items() if value == 0.0}
    | dict.fromkeys(BRAKES, (80.0, 800.0))
    | {name: (SOUND[name], 0.5) for name in TYRES}
    | {
        "coolant_temperature_c": (92.0, 150.0),
        "oil_pressure_bar": (2.5, 0.0),
        "fuel_share": (0.5, 0.0),
        "battery_voltage_v": (14.0, 9.0),
    }
)
CODES = ("P0217", "C0035", "P0420", "U0121", "P0462", "C0267", "P1234")
SHARES = st.dictionaries(st.sampled_from(sorted(WORSE)), st.floats(0, 1), max_size=8)


def values(shares: dict[str, float]) -> dict[str, float | None]:
    worsened = {name: WORSE[name][0] + share * (WORSE[name][1] - WORSE[name][0]) for name, share in shares.items()}
    return {**SOUND, **worsened}


def assessed(
    book: DtcBook,
    shares: dict[str, float],
    codes: tuple[str, ...] = (),
    held: Held | None = None,
    lost: set[str] | None = None,
) -> Assessment:
    seen = values(shares) | dict.fromkeys(lost or set())
    return assess(TABLE, seen, codes, book, held or Held())


def h(assessment: Assessment) -> float:
    assert assessment.degradation.h is not None
    return assessment.degradation.h


def envelope(assessment: Assessment) -> float:
    assert assessment.degradation.brake_envelope is not None
    return assessment.degradation.brake_envelope


PROPERTY = settings(max_examples=150, deadline=None, suppress_health_check=[HealthCheck.function_scoped_fixture])


def test_a_sound_car_is_exactly_sound(book: DtcBook) -> None:
    answer = assessed(book, {})
    advice = health.advise(TABLE, answer, book, "en")
    assert (h(answer), envelope(answer), answer.confidence) == (0.0, 1.0, 1.0)
    assert (advice.safe_to_drive, advice.speed_factor, advice.headway_factor) == ("yes", 1.0, 1.0)
    assert advice.advice == "No fault is reported."


@PROPERTY
@given(SHARES, st.sampled_from(sorted(WORSE)), st.floats(0, 1), st.sets(st.sampled_from(CODES)), st.sampled_from(CODES))
def test_more_faults_never_lower_h_and_never_raise_the_brakes(
    book: DtcBook, shares: dict[str, float], name: str, more: float, codes: set[str], code: str
) -> None:
    before = assessed(book, shares, tuple(sorted(codes)))
    worse = assessed(book, shares | {name: max(shares.get(name, 0.0), more)}, tuple(sorted(codes | {code})))
    assert h(worse) >= h(before) - 1e-12
    assert envelope(worse) <= envelope(before) + 1e-12
    factors_before, factors_worse = health.factors(before.degradation), health.factors(worse.degradation)
    assert factors_worse[0] <= factors_before[0] + 1e-12
    assert factors_worse[1] >= factors_before[1] - 1e-12


@PROPERTY
@given(SHARES, st.sets(st.sampled_from(sorted(SOUND))))
def test_a_signal_that_falls_silent_never_heals_the_car(
    book: DtcBook, shares: dict[str, float], lost: set[str]
) -> None:
    before = assessed(book, shares)
    after = assessed(book, shares, held=before.held, lost=lost)
    assert h(after) >= h(before) - 1e-12
    assert envelope(after) <= envelope(before) + 1e-12
    assert after.confidence <= before.confidence
    assert set(before.degradation.warning_lamps) <= set(after.degradation.warning_lamps)


@PROPERTY
@given(st.sets(st.sampled_from(sorted(SOUND)), min_size=1))
def test_a_signal_never_seen_is_no_better_than_a_sound_one(book: DtcBook, lost: set[str]) -> None:
    answer = assessed(book, {}, lost=lost)
    if answer.degradation.brake_envelope is not None:
        assert envelope(answer) <= 1.0
    hidden = {psi.name for psi in TABLE if lost & set(psi.fields) and psi.loss_unknown > 0.0}
    if hidden and answer.degradation.brake_envelope is not None:
        assert envelope(answer) < 1.0


def test_a_fault_ends_when_its_own_signal_says_so(book: DtcBook) -> None:
    faulty = assessed(book, {"abs_fault": 1.0, "lamp_abs": 1.0})
    silent = assessed(book, {}, held=faulty.held, lost={"abs_fault", "lamp_abs"})
    mended = assessed(book, {}, held=silent.held)
    assert h(silent) == pytest.approx(h(faulty))
    assert h(mended) == 0.0


def test_nothing_ever_read_is_unknown_and_not_healthy(book: DtcBook) -> None:
    answer = assessed(book, {}, lost=set(SOUND))
    advice = health.advise(TABLE, answer, book, "de")
    assert (answer.degradation.h, answer.degradation.brake_envelope) == (None, None)
    assert advice.safe_to_drive == "unknown"
    assert advice.speed_factor < 1.0


def test_an_overheated_engine_is_a_reason_to_stop_now(book: DtcBook) -> None:
    answer = assessed(book, {"coolant_temperature_c": 1.0}, ("P0217",))
    advice = health.advise(TABLE, answer, book, "de")
    assert advice.safe_to_drive == "stop_now"
    assert "abkühlen" in advice.advice


def test_a_failed_booster_leaves_the_regulations_residual_braking(book: DtcBook) -> None:
    assert envelope(assessed(book, {"brake_booster_fault": 1.0})) == pytest.approx(0.4)
