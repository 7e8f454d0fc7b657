"""Our CAN service and Peykan's server on the same buses: every shared tool answers alike, but for its listed faults."""

from collections.abc import Iterable, Mapping
from typing import Any

import pytest

from benchmarks.peykan import SUBJECT, THEIR_FAULTS
from benchmarks.subject import run_subject

pytest.importorskip("peykan", reason="Peykan is not installed: pip install peykan==0.2.1")

BUSES = ("simulated", "recorded")
Answers = dict[str, dict[str, dict[str, Any]]]


@pytest.fixture(scope="module")
def answers() -> Answers:
    """Of each bus, by call, what ours and theirs said."""
    found = run_subject(SUBJECT, "1", timeout_s=240)
    return {part: measured["answers"] for part, measured in found.items()}


def pair(answers: Answers, bus: str, call: str) -> tuple[Any, Any]:
    both = answers[bus][call]
    return both["ours"], both["theirs"]


def frames(rows: Iterable[Mapping[str, Any]]) -> list[tuple[float, int, tuple[int, ...]]]:
    return [(round(row["timestamp"], 5), int(row["arbitration_id"], 16), tuple(row["data"])) for row in rows]


@pytest.mark.parametrize("bus", BUSES)
@pytest.mark.parametrize("call", ["read_can_frames", "filter_frames by id", "filter_frames by signal"])
def test_both_heard_the_same_frames(bus: str, call: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, call)
    assert len(ours) > 100
    assert frames(ours) == frames(theirs)
    if call == "filter_frames by signal":
        assert [each["signal_value"] for each in ours] == pytest.approx([each["signal_value"] for each in theirs])


@pytest.mark.parametrize("bus", BUSES)
def test_a_signal_has_the_same_samples(bus: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, "monitor_signal")
    assert len(ours) > 100
    assert [each["timestamp"] for each in ours] == pytest.approx([each["timestamp"] for each in theirs], abs=1e-5)
    assert [each["value"] for each in ours] == pytest.approx([each["value"] for each in theirs])


@pytest.mark.parametrize("bus", BUSES)
def test_the_snapshot_has_the_same_values_and_units(bus: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, "get_vehicle_snapshot")
    described = {name: each for name, each in theirs["signals"].items() if not each["message"].startswith("J1939:")}
    assert len(described) > 10
    for name, each in described.items():
        if ours["signals"][name]["message"] != each["message"]:
            continue
        assert ours["signals"][name]["unit"] == each["unit"], name
        assert same(ours["signals"][name]["value"], each["value"]), name
    assert ours["frame_count"] == theirs["frame_count"]


def same(ours: Any, theirs: Any) -> bool:
    """Numbers within what Peykan rounds to."""
    return bool(ours == theirs if isinstance(theirs, str) else ours == pytest.approx(theirs, abs=0.001))


@pytest.mark.parametrize("bus", BUSES)
def test_a_frame_has_the_same_signals(bus: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, "decode_can_frame")
    assert (ours["status"], theirs["status"]) == ("ok", "success")
    assert ours["signals"] == pytest.approx(theirs["signals"])


@pytest.mark.parametrize("bus", BUSES)
def test_a_group_is_taken_apart_alike(bus: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, "decode_j1939_frame")
    assert (ours["pgn"], ours["priority"], ours["source"]) == (
        theirs["pgn"], theirs["priority"], theirs["source_address"],
    )  # fmt: skip
    assert (ours["destination"], theirs["is_broadcast"]) == (255, True)
    assert list(ours["signals"].values()) == pytest.approx(list(theirs["signals"].values()))


@pytest.mark.parametrize("bus", BUSES)
def test_the_groups_heard_are_among_those_that_theirs_could_decode(bus: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, "list_j1939_pgns")
    could = {each["pgn"]: each["length"] for each in theirs["pgns"]}
    heard = {each["pgn"]: each["length"] for each in ours if each["pgn"] != 0xFECA}
    assert heard
    assert heard.items() <= could.items()
    assert "not what was heard" in THEIR_FAULTS["list_j1939_pgns"]


@pytest.mark.parametrize("bus", BUSES)
def test_the_same_faults_are_broadcast_and_the_lamps_are_theirs_to_mend(bus: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, "read_j1939_dtcs")
    told = {
        (unit["source"], fault["spn"], fault["fmi"], fault["occurrences"])
        for unit in ours["units"]
        for fault in unit["faults"]
    }
    assert told
    assert told == {(e["source_address"], e["spn"], e["fmi"], e["occurrence_count"]) for e in theirs["dtcs"]}
    (unit,) = ours["units"]
    assert list(unit["lamps"].values()) == list(theirs["lamps"].values())[::-1]
    assert "read_j1939_dtcs lamps" in THEIR_FAULTS
    if bus == "simulated":  # the first byte is 0x40: the highest pair, the malfunction lamp, is on
        assert (unit["lamps"]["malfunction"], theirs["lamps"]["malfunction_indicator"]) == ("on", "off")


@pytest.mark.parametrize("what", ["coolant", "engine speed", "vehicle speed", "fuel level"])
def test_a_parameter_has_the_same_value_and_unit(what: str, answers: Answers) -> None:
    ours, theirs = pair(answers, "simulated", f"send_obd_request {what}")
    decoded = dict(ours["decoded"])
    assert (decoded.pop("unit"), *decoded.values()) == (theirs["decoded"]["unit"], theirs["decoded"]["value"])
    assert int(ours["arbitration_id"], 16) == int(theirs["arbitration_id"], 16)


def test_codes_are_asked_for_by_both_and_misread_by_theirs(answers: Answers) -> None:
    ours, theirs = pair(answers, "simulated", "send_obd_request codes")
    assert ours["decoded"]["stored_codes"] == ["P0118", "P0217"]
    assert theirs["raw_data"][1:7] == [0x43, 2, 0x01, 0x18, 0x02, 0x17]
    assert theirs["decoded"]["dtcs"] != ["P0118", "P0217"]
    assert "send_obd_request codes" in THEIR_FAULTS


def test_what_theirs_cannot_ask_of_a_standard_car(answers: Answers) -> None:
    ours, theirs = pair(answers, "simulated", "send_diagnostic_request")
    assert ours["responses"][0]["data_field"] == 36
    assert theirs["status"] == "failed"
    ours, theirs = pair(answers, "simulated", "activate_fault_scenario")
    assert "a person" in ours["message"] or ours["status"] == "refused"
    assert theirs["status"] == "timeout"
    assert {"send_diagnostic_request", "activate_fault_scenario"} <= THEIR_FAULTS.keys()


def test_a_group_that_is_asked_for_comes_alike(answers: Answers) -> None:
    ours, theirs = pair(answers, "simulated", "request_j1939_pgn")
    assert [list(each["signals"].values()) for each in ours["responses"]] == [
        pytest.approx(list(each["signals"].values())) for each in theirs["responses"]
    ]


def test_the_identification_number_is_the_same(answers: Answers) -> None:
    ours, theirs = pair(answers, "simulated", "read_vin")
    assert (ours["vin"], ours["check_digit_valid"]) == (theirs["vin"], theirs["check_digit_valid"])
    assert ours["check_digit_valid"] is True


def test_identifiers_have_the_same_bytes_and_values(answers: Answers) -> None:
    ours, theirs = pair(answers, "simulated", "uds_read_data")
    keys = ("did", "raw", "value", "unit")
    assert [[each.get(key) for key in keys] for each in ours["values"]] == [
        [each.get(key) for key in keys] for each in theirs["values"]
    ]
    ours, theirs = pair(answers, "simulated", "uds_read_data with an unknown one")
    assert (len(ours["values"]), theirs["values"]) == (2, [])
    assert "uds_read_data with an unknown one" in THEIR_FAULTS


def test_stored_codes_are_the_same(answers: Answers) -> None:
    ours, theirs = pair(answers, "simulated", "uds_read_dtcs")
    assert ours["dtcs"] == theirs["dtcs"]
    assert len(ours["dtcs"]) == 2


def test_clearing_works_for_both_and_takes_a_grant_for_ours(answers: Answers) -> None:
    found = answers["simulated"]["uds_clear_dtcs"]
    assert (found["ours"]["status"], found["theirs"]["status"]) == ("ok", "success")
    assert "takes a grant" in found["ours without a grant"]["message"]


def test_both_show_the_frames_that_left_flow_control_too(answers: Answers) -> None:
    ours, theirs = (sent(each) for each in pair(answers, "simulated", "get_transmit_log"))
    assert {(0x7DF, "0902"), (0x7E0, "flow control"), (0x7E0, "22f190"), (0x7E0, "1902ff")} <= ours
    their_own = {each for each in theirs if each[0] not in {0x7DF, 0x7E0, 0x18EAFFF9}}
    assert theirs - their_own <= ours
    assert len(their_own) <= 1  # the frame for its own simulator


def sent(log: Mapping[str, Any]) -> set[tuple[int, str]]:
    """Ids and requests, without what fills a frame up."""
    found = set()
    for record in log["records"]:
        payload, number = bytes.fromhex(record["data"]), int(record["arbitration_id"], 16)
        whole = payload.hex() if record["is_extended_id"] else payload[1 : 1 + payload[0]].hex()
        found.add((number, "flow control" if payload[0] >> 4 == 3 and not record["is_extended_id"] else whole))
    return found


@pytest.mark.parametrize("bus", BUSES)
def test_the_same_logs_are_listed(bus: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, "list_can_logs")
    assert ours["files"] == [each for each in theirs["files"] if not each.get("bundled")]


@pytest.mark.parametrize("bus", BUSES)
def test_a_log_holds_the_same_ids_rates_and_ranges(bus: str, answers: Answers) -> None:
    ours, theirs = (each["analysis"] for each in pair(answers, bus, "analyze_can_log"))
    for key in ("file", "frame_count", "error_frames", "duration_s", "distinct_ids"):
        assert ours[key] == theirs[key], key
    rates = {int(each["arbitration_id"], 16): each for each in theirs["ids"]}
    for each in ours["ids"]:
        other = rates[int(each["arbitration_id"], 16)]
        assert (each["count"], each.get("rate_hz")) == (other["count"], other.get("rate_hz"))
    ranges = {(each["name"], each["message"]): each for each in ours["signals"]}
    shared = [each for each in theirs["signals"] if not each["message"].startswith("J1939:")]
    assert len(shared) > 10
    for each in shared:
        mine = ranges[each["name"], each["message"]]
        for key, value in each.items():
            number = isinstance(value, float)
            assert mine[key] == (pytest.approx(value, rel=1e-9, abs=0.002) if number else value), (each["name"], key)
    assert [ids_in(each) for each in ours["timing_gaps"]] == [ids_in(each) for each in theirs["timing_gaps"]]


def ids_in(words: str) -> int:
    return int(words.split()[0].rstrip(":"), 16)


@pytest.mark.parametrize("bus", BUSES)
def test_a_log_holds_the_same_faults_and_codes_that_theirs_misreads(bus: str, answers: Answers) -> None:
    ours, theirs = (each["analysis"] for each in pair(answers, bus, "analyze_can_log"))
    keys = ("source_address", "spn", "fmi", "first_seen_s", "last_seen_s")
    assert sorted([each[key] for key in keys] for each in ours["j1939_dtcs"]) == sorted(
        [each[key] for key in keys] for each in theirs["j1939_dtcs"]
    )
    assert ours["j1939_dtcs"]
    if bus == "simulated":
        assert [each["code"] for each in ours["obd_dtcs"]] == ["P0118", "P0217"]
        assert {each["code"] for each in theirs["obd_dtcs"]}.isdisjoint({"P0118", "P0217"})
        assert "analyze_can_log codes" in THEIR_FAULTS


@pytest.mark.parametrize("bus", BUSES)
def test_a_signal_of_a_log_is_the_same_over_its_time(bus: str, answers: Answers) -> None:
    ours, theirs = (each["series"] for each in pair(answers, bus, "get_log_signal"))
    for key in ("signal", "message", "unit", "samples_total", "other_sources", "min", "max", "mean"):
        assert ours[key] == theirs[key], key
    values = {each["t_s"]: each["value"] for each in theirs["points"]}
    shared = [each for each in ours["points"] if each["t_s"] in values]
    assert len(shared) >= 2
    assert all(each["value"] == pytest.approx(values[each["t_s"]]) for each in shared)
    assert len(ours["points"]) == 50 < len(theirs["points"])
    assert "get_log_signal points" in THEIR_FAULTS


@pytest.mark.parametrize("bus", BUSES)
def test_neither_reads_outside_its_folder(bus: str, answers: Answers) -> None:
    ours, theirs = pair(answers, bus, "analyze_can_log outside")
    assert (ours["status"], theirs["status"]) == ("error", "error")
