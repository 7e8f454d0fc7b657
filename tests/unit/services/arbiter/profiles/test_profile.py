"""Profiles: sourced constants, and whether ACT can be reached."""

import hashlib
import json
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.arbiter.decide import decide
from services.arbiter.profiles.errors import ProfileError
from services.arbiter.profiles.profile import FOLDER, load, names, parse, reachability, read_file
from tests.unit.services.arbiter.support import CALIBRATED, PAPER, mirror, request, requests, track


def source(name: str) -> bytes:
    return (FOLDER / f"{name}.toml").read_bytes()


def test_both_profiles_ship() -> None:
    assert names() == ("calibrated", "paper")


@pytest.mark.parametrize("name", ["calibrated", "paper"])
def test_every_constant_has_symbol_unit_source_and_reason(name: str) -> None:
    for key, constant in read_file(source(name)).constants.items():
        assert constant.symbol, key
        assert constant.unit, key
        assert len(constant.source) > 3, key
        assert len(constant.reason) > 3, key


def test_the_papers_constants_are_the_printed_ones() -> None:
    printed = (0.1, 0.7, 2.0, 2.5, 0.6, 0.3, 0.1, 0.2, 0.4, 0.2, 0.6, 0.05)
    p = PAPER
    ours = (
        p.epsilon_mps, p.t_r_s, p.d0_m, p.tau_s, p.alpha, p.beta, p.gamma, p.delta, p.c_act, p.c_err, p.b_adv, p.c_fat,
    )  # fmt: skip
    assert ours == printed


def test_the_paper_needs_more_risk_than_there_is() -> None:
    reach = reachability(PAPER)
    assert reach.r_needed == pytest.approx(1.875)
    assert reach.r_max == pytest.approx(1.0)
    assert not reach.reachable
    assert not reachability(PAPER, 0.0).reachable


@pytest.mark.parametrize("delta", [0.0, 0.1, 0.2, 0.3, 0.4])
def test_the_calibrated_profile_reaches_act_at_every_delta_of_the_table(delta: float) -> None:
    reach = reachability(CALIBRATED, delta)
    assert reach.reachable
    assert reach.ttc_needed_healthy_s is not None


def test_a_larger_delta_waits_longer() -> None:
    times = [reachability(CALIBRATED, delta).ttc_needed_healthy_s for delta in (0.0, 0.1, 0.2, 0.3, 0.4)]
    assert times == pytest.approx([3.556, 2.815, 2.074, 1.333, 0.593], abs=5e-4)


@given(requests())
def test_the_paper_never_acts(asked: object) -> None:
    verdict = decide(asked, mirror(asked, profile=PAPER), PAPER)  # type: ignore[arg-type]
    assert verdict.command is None
    assert verdict.decision.kind != "ACT"
    assert verdict.decision.act_withheld == ""


def test_the_paper_does_not_act_even_at_the_bumper() -> None:
    asked = request(track(gap_m=0.5, closing_mps=20.0), h=1.0)
    assert decide(asked, mirror(asked, profile=PAPER), PAPER).decision.metrics.margin == pytest.approx(-0.15, abs=0.01)


@given(st.sampled_from((b"alpha", b"act_jerk_mps3", b"c_min")))
def test_a_missing_constant_is_refused(key: bytes) -> None:
    with pytest.raises(ProfileError):
        parse(source("calibrated").replace(b"[constants." + key + b"]", b"[constants.gone]"))


@pytest.mark.parametrize(
    ("before", "after"),
    [
        (b'reason = "kept"', b'reason = ""'),
        (b"value = 0.05\n", b"value = -1.0\n"),
        (b"value = 0.05\n", b"value = nan\n"),
        (b'a_max,brake"\nvalue = 8.0', b'a_max,brake"\nvalue = 0.0'),
        (b'ttc = "braking"', b'ttc = "guessed"'),
        (b'messages]\nsymbol = "-"\nvalue = 4.0', b'messages]\nsymbol = "-"\nvalue = 1.5'),
    ],
)
def test_a_constant_without_reason_or_out_of_bounds_is_refused(before: bytes, after: bytes) -> None:
    assert before in source("calibrated")
    with pytest.raises(ProfileError):
        parse(source("calibrated").replace(before, after, 1))


def test_another_number_is_another_hash() -> None:
    changed = parse(source("calibrated").replace(b"value = 4.0", b"value = 4.5", 1))
    assert changed.sha256 != load("calibrated").sha256


def with_value(key: str, value: object, field: str = "value") -> bytes:
    """The calibrated profile with another value of one constant, or another of its fields."""
    lines, inside = source("calibrated").decode().splitlines(), False
    for number, line in enumerate(lines):
        inside = line == f"[constants.{key}]" if line.startswith("[") else inside
        if inside and line.startswith(f"{field} ="):
            lines[number] = f"{field} = {json.dumps(value)}"
    return "\n".join(lines).encode()


def test_reachability_is_solved_for_the_risk_and_told_in_words() -> None:
    reach = reachability(CALIBRATED)
    assert reach.delta == CALIBRATED.delta
    assert reach.r_max_healthy == pytest.approx(0.9)
    assert reach.r_needed == pytest.approx((0.2 + 0.28 + 0.1 - 0.05) / 0.9)
    assert reach.r_max == pytest.approx(1.0)
    assert reach.text == (
        "profile calibrated, Delta 0.20: ACT can be reached; it needs r > 0.589, r is at most 1.000 (0.900 in a healthy car)"
    )
    told = reachability(PAPER).text
    assert told.startswith("profile paper, Delta 0.20: ACT cannot be reached; it needs r > 1.875")


def test_advice_that_is_as_good_as_acting_is_never_acted_upon() -> None:
    reach = reachability(parse(with_value("b_adv", 1.0)))
    assert reach.r_needed == float("inf")
    assert not reach.reachable
    assert reach.ttc_needed_healthy_s is None


def test_risk_that_urgency_adds_nothing_to_needs_no_time_to_collision() -> None:
    assert reachability(parse(with_value("alpha", 0.0))).ttc_needed_healthy_s is None


def test_a_risk_that_only_a_sick_car_has_is_reached_and_by_no_healthy_one() -> None:
    reach = reachability(CALIBRATED, 0.5)
    assert reach.reachable
    assert reach.ttc_needed_healthy_s is None
    assert not reachability(CALIBRATED, 0.6).reachable


@pytest.mark.parametrize(
    ("key", "value", "told"),
    [
        ("delta", 0.41, "calibrated: delta = 0.41 lies outside [0.0, 0.4]"),
        ("c_min", 0.39, "calibrated: c_min = 0.39 lies outside [0.4, 0.8]"),
        ("mu_unknown_low", 0.04, "calibrated: mu_unknown = 0.04 lies outside [0.05, 1.0]"),
        ("act_brake_max_mps2", 9.82, "calibrated: act_brake = 9.82 lies outside [2.0, 9.81]"),
        ("budget_reserve", 3.1, "calibrated: budget_reserve leaves no message of budget_messages for information"),
        ("d0_m", 1e6, "calibrated: d0_m = 1000000.0 is out of bounds"),
        ("d0_m", -0.1, "calibrated: d0_m = -0.1 is out of bounds"),
        *(
            (key, 0.0, "calibrated: tau, mu_floor, relax, budget_refill and brake_max must be above 0")
            for key in ("tau_s", "mu_floor", "relax_s", "budget_refill_s", "brake_max_mps2")
        ),
    ],
)
def test_what_is_refused_is_named_with_its_bounds(key: str, value: float, told: str) -> None:
    with pytest.raises(ProfileError) as error:
        parse(with_value(key, value), "mine")
    assert str(error.value) == told


@pytest.mark.parametrize(
    ("key", "value"),
    [
        ("delta", 0.4), ("delta", 0.0), ("c_min", 0.4), ("c_min", 0.8), ("mu_unknown_low", 0.05), ("mu_unknown_low", 1.0),
        ("act_brake_max_mps2", 9.81), ("act_brake_max_mps2", 2.0), ("budget_reserve", 3.0), ("d0_m", 0.0), ("d0_m", 999_999.0),
        ("tau_s", 0.5),
    ],
)  # fmt: skip
def test_a_bound_itself_is_allowed(key: str, value: float) -> None:
    assert getattr(parse(with_value(key, value)), key) == value


@pytest.mark.parametrize("field", ["unit", "source", "reason"])
def test_what_a_constant_lacks_is_told(field: str) -> None:
    with pytest.raises(ProfileError, match=r"^calibrated: d0_m lacks its unit, source or reason$"):
        parse(with_value("d0_m", "", field))


def test_a_file_that_is_no_profile_is_refused_by_its_label() -> None:
    with pytest.raises(ProfileError, match=r"^mine: "):
        parse(b"no = [toml", "mine")
    with pytest.raises(ProfileError, match=r"^profile: "):
        parse(b"name = 1")
    with pytest.raises(ProfileError, match=r"^profile: "):
        read_file(b"name = 1")
    with pytest.raises(ProfileError, match=r"^mine: .*gone"):
        parse(source("calibrated").replace(b"[constants.alpha]", b"[constants.gone]"), "mine")


def test_a_profile_is_read_by_its_name_or_from_its_file(tmp_path: Path) -> None:
    (file := tmp_path / "own.toml").write_bytes(with_value("d0_m", 3.0))
    assert load(file).d0_m == 3.0
    assert load(str(file)).sha256 == hashlib.sha256(file.read_bytes()).hexdigest()
    with pytest.raises(FileNotFoundError):
        load("nowhere")
    file.write_bytes(b"none")
    with pytest.raises(ProfileError) as error:
        load(file)
    assert str(error.value).startswith(f"{file}: ")
