"""What may leave on a bus."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.can.diagnostics import gate
from services.can.diagnostics.addresses import FUNCTIONAL_IDS, PHYSICAL_IDS, REQUEST_IDS
from services.can.diagnostics.isotp import FLOW_FRAMES, single_frame
from services.can.errors import RequestRefused

IDS = st.one_of(st.integers(0, 0x1FFFFFFF), st.sampled_from(sorted(REQUEST_IDS)))
REQUESTS = st.binary(min_size=1, max_size=7).map(single_frame)
FRAMES = st.one_of(st.binary(max_size=12), REQUESTS, st.sampled_from(sorted(FLOW_FRAMES)))
ALLOWED = st.frozensets(st.integers(0, 255), max_size=4)


@given(IDS, FRAMES, ALLOWED)
def test_only_whitelisted_ids_and_services_and_flow_control_pass(
    arbitration_id: int, data: bytes, allowed: frozenset[int]
) -> None:
    try:
        gate.check(arbitration_id, data, allowed)
    except RequestRefused:
        return
    assert arbitration_id in FUNCTIONAL_IDS | PHYSICAL_IDS
    if data not in FLOW_FRAMES:
        assert data[1] in gate.READING | (allowed & {0x04, 0x11, 0x14, 0x31})
        assert data[1] != 0x31 or arbitration_id == gate.TEST_UNIT_ID
        assert data[1] != 0x11 or arbitration_id in PHYSICAL_IDS


@given(IDS, REQUESTS)
def test_without_permission_nothing_that_changes_the_car_passes(arbitration_id: int, data: bytes) -> None:
    if data[1] not in gate.READING:
        with pytest.raises(RequestRefused):
            gate.check(arbitration_id, data)


@pytest.mark.parametrize("service", [0x10, 0x27, 0x28, 0x2E, 0x2F, 0x34, 0x36, 0x3D, 0x85])
def test_writing_and_sessions_pass_with_no_permission_at_all(service: int) -> None:
    for payload in (bytes([service, 1]), bytes([service, 1, 2, 3])):
        with pytest.raises(RequestRefused, match="changes the vehicle"):
            gate.check(0x7E0, single_frame(payload), frozenset(range(256)))


@pytest.mark.parametrize("payload", [b"\x19\x0f\xff", b"\x3e\x80", b"\x19", b"\x3e"])
def test_a_reading_service_passes_with_its_reading_subfunctions_only(payload: bytes) -> None:
    with pytest.raises(RequestRefused, match="sub-function"):
        gate.check(0x7E0, single_frame(payload))


def test_clearing_passes_only_where_it_was_allowed() -> None:
    gate.check(0x7DF, single_frame(b"\x04"), frozenset({0x04}))
    gate.check(0x18DB33F1, single_frame(b"\x04"), frozenset({0x04}))
    with pytest.raises(RequestRefused):
        gate.check(0x7DF, single_frame(b"\x04"), frozenset({0x14}))
    with pytest.raises(RequestRefused, match="one unit"):
        gate.check(0x7DF, single_frame(b"\x11\x01"), frozenset({0x11}))


@given(st.lists(st.tuples(st.floats(0.0, 2.0), st.sampled_from([0.0, 10.0])), min_size=1, max_size=300))
def test_no_more_frames_leave_than_the_pace_allows(steps: list[tuple[float, float]]) -> None:
    now = [0.0]
    pace = gate.Pace(rate_per_s=50.0, burst=20.0, clock=lambda: now[0])
    left: list[float] = []
    for wait_s, keep in steps:
        now[0] += wait_s
        while pace.take(keep) == 0.0:
            left.append(now[0])
    for i, first in enumerate(left):
        for j in range(i, len(left)):
            assert j - i + 1 <= 20.0 + 50.0 * (left[j] - first) + 1e-6
