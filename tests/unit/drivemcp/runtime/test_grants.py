"""Grants: what is signed counts, for what it names, while it lasts."""

from datetime import UTC, datetime, timedelta

import msgspec
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from drivemcp.runtime import grants
from drivemcp.runtime.grants import GrantRefused, canonical, key_id, make_key, read_grant, sign_grant, verify_grant
from proto.decision import Grant

KEY, STRANGER = make_key(), make_key()
NOW = datetime(2030, 1, 1, 12, tzinfo=UTC)
PLAIN = Grant(
    grant_id="g-1",
    vehicle="ego",
    capability="actuation/brake",
    max_deceleration_mps2=4.0,
    max_duration_s=2.0,
    issued_at=(NOW - timedelta(hours=1)).isoformat(),
    expires_at=(NOW + timedelta(hours=1)).isoformat(),
)
SIGNED = sign_grant(PLAIN, KEY.private)


def check(grant: Grant, *, now: datetime = NOW, vehicle: str = "ego", capability: str = "actuation/brake") -> None:
    verify_grant(grant, (STRANGER.public, KEY.public), vehicle=vehicle, capability=capability, now=now)


def test_a_signed_grant_counts_and_survives_its_file() -> None:
    check(SIGNED)
    check(read_grant(msgspec.json.encode(SIGNED)))
    assert SIGNED.key_id == key_id(KEY.public)


@pytest.mark.parametrize(
    ("field", "value"),
    [
        ("max_deceleration_mps2", 9.0),
        ("max_duration_s", 20.0),
        ("expires_at", (NOW + timedelta(hours=9)).isoformat()),
        ("sequence", 7),
        ("vehicle", "other"),
        ("grant_id", "g-2"),
        ("capability", "tool:clear_dtcs"),
    ],
)
def test_one_changed_field_makes_it_worthless(field: str, value: object) -> None:
    changed = msgspec.structs.replace(SIGNED, **{field: value})
    with pytest.raises(GrantRefused, match="altered"):
        check(changed, vehicle=changed.vehicle, capability=changed.capability)


def test_it_counts_for_its_vehicle_capability_and_time_only() -> None:
    with pytest.raises(GrantRefused, match="is for"):
        check(SIGNED, vehicle="other")
    with pytest.raises(GrantRefused, match="is for"):
        check(SIGNED, capability="tool:clear_dtcs")
    for now in (NOW - timedelta(hours=2), NOW + timedelta(hours=1)):
        with pytest.raises(GrantRefused, match="valid from"):
            check(SIGNED, now=now)


def test_an_unknown_key_an_absent_or_a_copied_signature_do_not_count() -> None:
    for grant in (
        PLAIN,
        sign_grant(PLAIN, make_key().private),
        msgspec.structs.replace(SIGNED, key_id=key_id(STRANGER.public)),
        msgspec.structs.replace(SIGNED, signature="AAAA"),
        msgspec.structs.replace(SIGNED, signature="not base64!"),
    ):
        with pytest.raises(GrantRefused):
            check(grant)


@pytest.mark.parametrize(
    "fields",
    [
        {"max_deceleration_mps2": 0.0},
        {"max_deceleration_mps2": 11.0},
        {"max_duration_s": 31.0},
        {"expires_at": PLAIN.issued_at},
        {"expires_at": "tomorrow"},
        {"expires_at": (NOW + timedelta(hours=23, seconds=1)).isoformat()},
        {"sequence": -1},
    ],
)
def test_impossible_bounds_are_never_signed(fields: dict[str, object]) -> None:
    with pytest.raises(GrantRefused):
        sign_grant(msgspec.structs.replace(PLAIN, **fields), KEY.private)


def test_a_grant_for_more_than_a_day_does_not_count_whoever_signed_it(monkeypatch: pytest.MonkeyPatch) -> None:
    longer = msgspec.structs.replace(PLAIN, expires_at=(NOW + timedelta(days=2)).isoformat())
    with monkeypatch.context() as careless:
        careless.setattr(grants, "LONGEST", timedelta(days=400))
        signed = sign_grant(longer, KEY.private)
    with pytest.raises(GrantRefused, match="more than 24 hours"):
        check(signed)


def test_a_confirmation_is_for_one_command_once_and_for_a_minute() -> None:
    now_s = 0.0
    waiting = grants.Confirmations(lambda: now_s)
    said = waiting.ask("clear_dtcs", b"{}")
    assert not waiting.take("clear_dtcs", b'{"by":"obd"}', said)
    assert not waiting.take("reset_ecu", b"{}", said)
    assert waiting.take("clear_dtcs", b"{}", said)
    assert not waiting.take("clear_dtcs", b"{}", said)
    late = waiting.ask("clear_dtcs", b"{}")
    now_s = grants.CONFIRM_WITHIN_S
    assert not waiting.take("clear_dtcs", b"{}", late)


def test_a_flood_of_unconfirmed_commands_keeps_the_newest() -> None:
    waiting = grants.Confirmations()
    asked = [waiting.ask("clear_dtcs", b"{}") for _ in range(10 * grants.MOST_WAITING)]
    assert len(set(asked)) == len(asked)
    kept = [one for one in asked if waiting.take("clear_dtcs", b"{}", one)]
    assert kept == asked[-grants.MOST_WAITING :]


@settings(max_examples=50)
@given(st.binary(max_size=200))
def test_a_damaged_file_is_refused_in_one_line(data: bytes) -> None:
    with pytest.raises(GrantRefused):
        read_grant(data)


def test_what_is_signed_does_not_depend_on_the_order_of_fields() -> None:
    fields = msgspec.to_builtins(PLAIN)
    turned = msgspec.convert(dict(reversed(fields.items())), Grant)
    assert canonical(turned) == canonical(PLAIN)
    assert b"signature" not in canonical(SIGNED)


def test_a_grant_that_names_no_envelope_is_soft_and_keeps_the_bytes_that_were_signed() -> None:
    fields = msgspec.json.decode(msgspec.json.encode(SIGNED))
    del fields["envelope"]
    old = read_grant(msgspec.json.encode(fields))
    assert old.envelope == "soft"
    assert canonical(old) == canonical(SIGNED)
    assert b"envelope" not in canonical(old)


def test_no_signed_grant_can_be_widened_to_emergencies() -> None:
    widened = msgspec.structs.replace(SIGNED, envelope="emergency")
    with pytest.raises(GrantRefused):
        verify_grant(widened, [KEY.public], vehicle="ego", capability="actuation/brake", now=NOW)
