"""Profiles: sourced constants, and whether ACT can be reached."""

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
