"""Text from the world and from tools is data."""

import msgspec
from hypothesis import given
from hypothesis import strategies as st

from tests.unit.services.orchestrator.judge import arbiter
from tests.unit.services.orchestrator.scenes import acts, hostile, next_seen, one, scenes, target
from tests.unit.services.orchestrator.support import (
    EXPERTS,
    FEW,
    Drive,
    Played,
    fact,
    health,
    limit_sign,
    meaning,
    replace,
)


@FEW
@given(
    drive=scenes(), text=hostile, kind=st.sampled_from(("sign", "limit", "message", "light", "jurisdiction", "plate"))
)
def test_text_in_the_world_raises_no_target_changes_no_call_and_enables_no_act(
    drive: Drive, text: str, kind: str
) -> None:
    sign = fact("sign", "danger", track_id=40, distance_m=20.0)
    spoken = replace(sign, text=text, sentence=text, plates=(text,), lane_id=text, camera=text)
    foreign = replace(sign, kind=kind, reading=text, value=None, track_id=41, believed=True, confidence=1.0)
    plain_ask = Played(drive.ask.table, arbiter=arbiter())
    before = one(drive, next_seen(drive, sign), plain_ask)
    hostile_ask = Played(drive.ask.table, arbiter=arbiter())
    after = one(drive, next_seen(drive, spoken, foreign), hostile_ask)
    country = kind == "jurisdiction" and len(text) == 3 and text.isascii() and text.isupper() and text.isalpha()
    if text in ("limit:130",) or country:
        return  # a code of the table, not text; and a statement of the front end, which has its own list of countries
    assert target(after) <= target(before) + 1e-9
    assert [call.tool for call in hostile_ask.calls] == [call.tool for call in plain_ask.calls]
    assert acts(before) == acts(after)


@FEW
@given(drive=scenes(), text=hostile)
def test_text_in_tools_answers_raises_no_target_and_enables_no_act(drive: Drive, text: str) -> None:
    experts = {
        "interpret_sign": lambda a: meaning(a["reading"], meaning=text, note=text, national_code=text),
        "lookup_rule": lambda a: msgspec.structs.replace(EXPERTS["lookup_rule"](a), note=text),
        "right_of_way": lambda a: msgspec.structs.replace(EXPERTS["right_of_way"](a), note=text),
        "vehicle_health": lambda a: health(0.3, advice=text, safe_to_drive=text),
    }
    seen = next_seen(drive, limit_sign("limit:30", passed=False, plates=("plate:when_wet:de",), scope="when_wet"))
    before = one(drive, seen)
    after = one(drive, seen, Played({**drive.ask.table, **experts}, arbiter=arbiter()))
    assert target(after) <= target(before) + 1e-9
    assert acts(before) == acts(after)
