"""Health as properties: more faults never heal, silence never heals, a sound car is exactly sound."""

from collections.abc import Mapping

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.paths import data
from proto.vehicle import SensorFault
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.health import degradation
from services.can.health.degradation import Assessment, Held, assess
from services.can.health.indicators import BRAKES, LAMPS, MEASURED, SOFTNESS, TYRES, table
from services.can.health.sensor_words import in_words
from services.can.profiles.profile import load_profile

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
        "brake_effect": 1.0,
        "pedal_pressure": 1.0,
        "outside_light_lux": 20_000.0,
        "rain_sensor": 0.0,
        "wiper_stage": 0.0,
        "headlamps": 0.0,
    }
    | dict.fromkeys(SOFTNESS, 0.0)
)
# How each field gets worse.
WORSE: dict[str, tuple[float, float]] = (
    {name: (0.0, 1.0) for name, value in SOUND.items() if value == 0.0 and name not in ("wiper_stage", "headlamps")}
    | dict.fromkeys(BRAKES, (80.0, 800.0))
    | {name: (SOUND[name], 0.5) for name in TYRES}
    | {
        "coolant_temperature_c": (92.0, 150.0),
        "oil_pressure_bar": (2.5, 0.0),
        "fuel_share": (0.5, 0.0),
        "battery_voltage_v": (14.0, 9.0),
        "brake_effect": (1.0, 0.1),
        "pedal_pressure": (1.0, 0.1),
        "outside_light_lux": (20_000.0, 0.0),
    }
    | dict.fromkeys(SOFTNESS, (0.0, 0.05))
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
    advice = degradation.advise(TABLE, answer, book, "en")
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
    factors_before, factors_worse = degradation.factors(before.degradation), degradation.factors(worse.degradation)
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
    advice = degradation.advise(TABLE, answer, book, "de")
    assert (answer.degradation.h, answer.degradation.brake_envelope) == (None, None)
    assert advice.safe_to_drive == "unknown"
    assert advice.speed_factor < 1.0


@PROPERTY
@given(SHARES, st.sets(st.sampled_from(sorted(MEASURED))), st.sets(st.sampled_from(sorted(SOUND))))
def test_a_dead_bus_is_told_whatever_was_measured_before_and_whatever_the_car_lacks(
    book: DtcBook, shares: dict[str, float], measured: set[str], lacks: set[str]
) -> None:
    alive = {name: each for name, each in values(shares).items() if name not in lacks | (MEASURED - measured)}
    dead = {name: each if name in MEASURED else None for name, each in alive.items()}
    before = assess(TABLE, alive, (), book, Held())
    after = assess(TABLE, dead, (), book, before.held)
    heard = any(psi.on(alive) and psi.from_bus(alive) for psi in TABLE)
    assert ("bus_silent" in {each.name for each in after.degradation.indicators}) is heard
    assert "bus_silent" not in {each.name for each in before.degradation.indicators}
    if heard:
        assert h(after) > h(before)


@pytest.mark.parametrize("car", ["sim", "vw_golf7", "ford_fusion", "toyota_rav4", "tesla_model3"])
def test_a_car_of_which_nothing_was_ever_read_is_unknown_and_not_healthy(book: DtcBook, car: str) -> None:
    profile = load_profile(data(f"vehicles/{car}/profile.toml"))
    names = {name for psi in TABLE for name in psi.fields} | set(LAMPS) | {"engine_running"}
    answer = assess(TABLE, dict.fromkeys(names & profile.fields.keys()), (), book, Held())
    assert answer.degradation.h is None
    assert degradation.safe_to_drive(TABLE, answer.degradation, book) == "unknown"


@pytest.mark.parametrize("lacks", ["outside_light_lux", "headlamps", "rain_sensor", "wiper_stage"])
def test_an_indicator_of_two_fields_takes_both(book: DtcBook, lacks: str) -> None:
    dark_and_wet = {**SOUND, "outside_light_lux": 0.0, "rain_sensor": 1.0}
    answer = assess(TABLE, {name: each for name, each in dark_and_wet.items() if name != lacks}, (), book, Held())
    assert len(answer.degradation.indicators) == 1
    assert answer.degradation.unknown == ()


def test_an_overheated_engine_is_a_reason_to_stop_now(book: DtcBook) -> None:
    answer = assessed(book, {"coolant_temperature_c": 1.0}, ("P0217",))
    advice = degradation.advise(TABLE, answer, book, "de")
    assert advice.safe_to_drive == "stop_now"
    assert "abkühlen" in advice.advice


def test_a_failed_booster_leaves_the_regulations_residual_braking(book: DtcBook) -> None:
    assert envelope(assessed(book, {"brake_booster_fault": 1.0})) == pytest.approx(0.4)


@pytest.mark.parametrize("share", [0.7, 0.5, 0.2])
def test_weak_brakes_leave_just_the_braking_that_was_measured(book: DtcBook, share: float) -> None:
    answer = assess(TABLE, {**SOUND, "brake_effect": share}, (), book, Held())
    assert envelope(answer) == pytest.approx(share)
    assert degradation.factors(answer.degradation)[0] <= share**0.5 + 1e-9


def test_each_soft_tyre_is_named_and_counts(book: DtcBook) -> None:
    one = assess(TABLE, {**SOUND, TYRES[0]: 1.4}, (), book, Held())
    two = assess(TABLE, {**SOUND, TYRES[0]: 1.4, TYRES[3]: 1.6}, (), book, Held())
    assert [each.name for each in one.degradation.indicators] == ["tyre_pressure_low_fl"]
    assert [each.name for each in two.degradation.indicators] == ["tyre_pressure_low_fl", "tyre_pressure_low_rr"]
    assert (h(two) > h(one), envelope(two) < envelope(one)) == (True, True)


def test_a_tyre_without_a_pressure_sensor_is_judged_by_its_wheel(book: DtcBook) -> None:
    bare = {name: value for name, value in SOUND.items() if name not in TYRES}
    answer = assess(TABLE, {**bare, SOFTNESS[2]: 0.02}, (), book, Held())
    assert [each.name for each in answer.degradation.indicators] == ["tyre_pressure_low_rl"]


@pytest.mark.parametrize(
    ("changed", "name"),
    [
        ({"outside_light_lux": 50.0}, "lamps_off_in_the_dark"),
        ({"rain_sensor": 0.5}, "wipers_off_in_rain"),
        ({"pedal_pressure": 0.4}, "pedal_spongy"),
        ({BRAKES[1]: 600.0}, "brakes_hot"),
    ],
)
def test_what_is_wrong_is_named(book: DtcBook, changed: dict[str, float], name: str) -> None:
    answer = assess(TABLE, {**SOUND, **changed}, (), book, Held())
    assert [each.name for each in answer.degradation.indicators] == [name]
    lit = assess(TABLE, {**SOUND, **changed, "headlamps": 2.0, "wiper_stage": 1.0}, (), book, Held())
    assert (lit.degradation.indicators == ()) == (name in ("lamps_off_in_the_dark", "wipers_off_in_rain"))


def test_darkness_that_is_not_known_is_neither_light_nor_a_fault(book: DtcBook) -> None:
    answer = assess(TABLE, {**SOUND, "outside_light_lux": None}, (), book, Held())
    assert answer.degradation.unknown == ("lamps_off_in_the_dark",)
    assert degradation.safe_to_drive(TABLE, answer.degradation, book) == "with_care"


FAULTS = tuple(SensorFault(field=name, kind="stuck") for name in ("speed_mps", "wheel_fl_mps", TYRES[0]))


@PROPERTY
@given(SHARES, st.integers(0, 2), st.integers(0, 2))
def test_more_doubted_sensors_never_lower_h(book: DtcBook, shares: dict[str, float], few: int, more: int) -> None:
    def with_faults(count: int) -> Assessment:
        return assess(TABLE, values(shares), (), book, Held(), FAULTS[:count])

    before, after = with_faults(few), with_faults(few + more)
    assert h(after) >= h(before) - 1e-12
    assert degradation.factors(after.degradation)[0] <= degradation.factors(before.degradation)[0] + 1e-12


def test_what_a_convicted_sensor_made_us_believe_is_forgotten_and_nothing_else(book: DtcBook) -> None:
    faulty = assessed(book, {TYRES[0]: 1.0, TYRES[1]: 1.0})
    held = degradation.forget(TABLE, faulty.held, frozenset({TYRES[0]}))
    seen = {**SOUND, TYRES[0]: None, TYRES[1]: None}
    after = assess(TABLE, seen, (), book, held, (SensorFault(field=TYRES[0], kind="offset"),))
    names = {each.name for each in after.degradation.indicators}
    assert names == {"tyre_pressure_low_fr", "sensors_faulty"}
    assert "tyre_pressure_low_fl" in after.degradation.unknown
    assert envelope(after) < 1.0


@pytest.mark.parametrize("language", ["en", "de", "fr", "nl", "pl", "it", "es"])
def test_doubted_sensors_are_told_in_words(book: DtcBook, language: str) -> None:
    answer = assess(TABLE, SOUND, (), book, Held(), FAULTS[:1])
    advice = degradation.advise(TABLE, answer, book, language)
    assert in_words("speed_mps", language) in advice.advice
    assert "_mps" not in advice.advice
    assert advice.safe_to_drive == "with_care"
    assert advice.sensor_faults == FAULTS[:1]


@pytest.mark.parametrize(("asked", "spoken"), [("xx", "en"), ("", "en"), ("de-AT", "de")])
@pytest.mark.parametrize("faults", [FAULTS[:1], ()])
def test_a_language_that_is_not_spoken_becomes_english(
    book: DtcBook, asked: str, spoken: str, faults: tuple[SensorFault, ...]
) -> None:
    answer = assess(TABLE, SOUND, (), book, Held(), faults)
    told, expected = (degradation.advise(TABLE, answer, book, each).advice for each in (asked, spoken))
    assert told == expected
