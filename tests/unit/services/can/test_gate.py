"""What may leave on a bus."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from services.can import gate
from services.can.errors import RequestRefused
from services.can.isotp import FLOW_CONTINUE, single_frame


@given(st.integers(0, 0x1FFFFFFF), st.binary(max_size=8))
def test_only_reading_requests_on_diagnostic_ids_and_flow_control_pass(arbitration_id: int, data: bytes) -> None:
    try:
        gate.check(arbitration_id, data)
    except RequestRefused:
        return
    assert arbitration_id == 0x7DF or 0x7E0 <= arbitration_id <= 0x7E7
    assert data == FLOW_CONTINUE or data[1] in gate.READING


@given(st.integers(0, 255).filter(lambda service: service not in gate.READING))
def test_a_service_that_changes_the_car_is_refused(service: int) -> None:
    with pytest.raises(RequestRefused, match="changes the vehicle"):
        gate.check(0x7E0, single_frame(bytes([service])))


def test_clearing_passes_only_where_it_was_allowed() -> None:
    gate.check(0x7DF, single_frame(b"\x04"), clearing=True)
    with pytest.raises(RequestRefused):
        gate.check(0x7DF, single_frame(b"\x04"), faults=True)
    with pytest.raises(RequestRefused):
        gate.check(0x7DF, single_frame(b"\x11\x01"), clearing=True, faults=True)
