"""What is told of a unit's answer: never the vehicle's identification number in the clear unless it is allowed."""

import msgspec
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from services.can.diagnostics.client import Diagnostics, Reply
from services.can.diagnostics.trouble_codes import DtcBook
from services.can.profiles.dbc import Dbc
from services.can.profiles.privacy import Privacy
from services.can.profiles.profile import Profile
from services.can.tools import requests
from services.can.tools.replies import unit_answer, unit_answers, unit_response
from services.can.vehicle import Vehicle

VIN_LETTERS = "ABCDEFGHJKLMNPRSTUVWXYZ0123456789"
vins = st.text(VIN_LETTERS, min_size=17, max_size=17)
HIDING, OPEN = Privacy(salt=b"salt"), Privacy(salt=b"salt", allow_vin=True)
ENGINE = 0x7E8


def told(privacy: Privacy, payload: bytes, answer: bytes) -> bytes:
    """Both shapes of an answer, as they leave."""
    words = unit_answer({}, privacy, ENGINE, payload, answer)
    numbers = unit_response({}, privacy, ENGINE, answer, 0)
    return msgspec.json.encode(words) + msgspec.json.encode(numbers)


def spelt(vin: str, heap: bytes) -> list[str]:
    """How `heap` spells it: as text, as hex, as a list of bytes."""
    data = vin.encode()
    return [way for way in (vin, data.hex().upper(), ",".join(map(str, data))) if way.encode() in heap]


@given(vin=vins, identifier=st.integers(0, 0xFFFF), before=st.binary(max_size=8), after=st.binary(max_size=8))
def test_no_identifier_tells_the_number(vin: str, identifier: int, before: bytes, after: bytes) -> None:
    head = identifier.to_bytes(2, "big")
    answer = b"\x62" + head + before + vin.encode() + after
    assert spelt(vin, told(HIDING, b"\x22" + head, answer)) == []
    assert spelt(vin, told(OPEN, b"\x22" + head, answer)) != []


@pytest.mark.parametrize("head", ["22F190", "22F802"])
def test_where_the_number_is_asked_for_its_hash_is_told(head: str) -> None:
    request, vin = bytes.fromhex(head), "WDM0S1M0000000001"
    answer = unit_answer({}, HIDING, ENGINE, request, b"\x62" + request[1:] + vin.encode())
    assert answer.decoded == {"vin": HIDING.vin(vin)}


@given(vin=vins, before=st.binary(max_size=8), after=st.binary(max_size=8))
def test_no_snapshot_tells_the_number(vin: str, before: bytes, after: bytes) -> None:
    payload = b"\x19\x04\xc0\x35\x00\x01"
    answer = b"\x59\x04\xc0\x35\x00\x2f\x01\x01" + before + vin.encode() + after
    assert spelt(vin, told(HIDING, payload, answer)) == []


def test_what_only_looks_like_a_number_says_why_it_is_not_told() -> None:
    answer = unit_answer({}, HIDING, ENGINE, b"\x22\xf1\x87", b"\x62\xf1\x87" + b"1K0907379AB012345")
    assert answer.decoded is not None
    assert "allow_vin is off" in answer.decoded["held_back"]
    assert answer.raw_data is None


def test_part_numbers_and_codes_are_told_as_ever() -> None:
    answers = {0x7E8: b"\x62\xf1\x87" + b"1K0907379AB"}
    (part,) = unit_answers({}, HIDING, b"\x22\xf1\x87", Reply(answers, "answered"))
    assert part.decoded == {"part_number": "1K0907379AB"}
    assert part.raw_data == list(answers[0x7E8])


@pytest.fixture(scope="module")
def vehicle(dbc: Dbc, profile: Profile, book: DtcBook) -> Vehicle:
    return Vehicle({"can0": dbc}, profile, book, lambda arbitration_id, data: None)


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(service=st.sampled_from([1, 2, 3, 7, 9, 10]), pid=st.integers(0, 255), rest=st.binary(max_size=40))
def test_no_answer_however_short_breaks_the_tool(
    monkeypatch: pytest.MonkeyPatch, vehicle: Vehicle, service: int, pid: int, rest: bytes
) -> None:
    """As `ask` gives them: service and parameter fit, the rest may be anything."""
    head = bytes([service + 0x40]) + (b"" if service in (3, 7, 10) else bytes([pid]))
    reply = Reply({0x7E8: head + rest, 0x7EA: head}, "answered")
    monkeypatch.setattr(Diagnostics, "ask", lambda *_, **__: reply)
    answer = requests.send_obd(vehicle, service, pid, 1.0)
    assert answer.status == "ok"
    assert [unit.arbitration_id for unit in answer.units] == ["0x7E8", "0x7EA"]
