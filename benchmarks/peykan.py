"""Our CAN service beside Peykan's server: what each has, and how long a call of every shared tool takes."""

import sys
from collections.abc import Mapping
from importlib.util import find_spec
from typing import Any

from benchmarks.figures import median, table
from benchmarks.subject import run_subject
from drivemcp.errors import UserError

VERSION = "0.2.1"
SUBJECT = "benchmarks.peers.beside_peykan"
ROUNDS = 12
THEIR_FAULTS: Mapping[str, str] = {
    "send_obd_request codes": "takes the count of ISO 15765-4 for the first byte of a code, so every code is a wrong one",
    "send_diagnostic_request": "sends a message of its own description, no ISO 14229; without that message it fails",
    "activate_fault_scenario": "asks its own simulator alone, by a frame of its own",
    "read_j1939_dtcs lamps": "reads the lamps of DM1 from the lowest bit pair; J1939-73 begins at the highest",
    "uds_read_data with an unknown one": "one refused identifier loses the values of all others",
    "get_log_signal points": "gives more points than max_points allows",
    "analyze_can_log codes": "the count again, and of long answers the first frame alone",
    "list_j1939_pgns": "lists what it could decode, not what was heard",
}
"""Where the answers differ, and why theirs is the wrong one. A test expects each."""
FEATURES = (
    ("tools by the same names", "20 of its 22", "22"),
    ("replay_can_log, stop_log_replay", "no: a recording is a bus of the configuration", "yes"),
    ("several buses, each with its description", "yes", "no"),
    ("descriptions", "DBC, ARXML, KCD, SYM", "DBC"),
    ("J1939 names and signals", "of the description", "a catalogue of seven groups"),
    ("who answered, who is missing", "every unit, by name", "the first answer"),
    ("answers longer than a frame", "OBD and UDS", "identification number and UDS"),
    ("values judged (age, range, counter, checksum)", "yes", "no"),
    ("health score, codes in words, advice", "yes", "no"),
    ("identification number", "hashed unless allowed", "in the clear"),
    ("raw frames of a real car", "off unless allowed", "on"),
    ("clearing codes", "grant, confirmation, standing car", "a setting"),
    ("sending on hardware", "reading services; off or narrowed by bus", "off unless allowed; narrowed by id"),
    ("check of frames at the bus itself", "yes: ids, services, bytes", "yes: ids, a switch for writing"),
    ("frames a second limited", "yes", "no"),
    ("transmit log in a file", "no", "yes"),
    ("lost adapter opened again", "yes", "no"),
    ("malformed records of a log", "counted, first told", "end the reading"),
    ("size and time of a log's reading", "256 MB, 2 million frames, 20 s", "2 million frames"),
    ("authentication", "token, TLS by a proxy", "no"),
    ("live page", "its own service", "yes"),
)


def peykan() -> str:
    """The tables. Raises UserError where Peykan is not installed."""
    if find_spec("peykan") is None:
        raise UserError(f"Peykan is not installed: pip install peykan=={VERSION}")
    sys.stderr.write(f"  {ROUNDS} rounds of every shared tool\n")
    found = run_subject(SUBJECT, str(ROUNDS), timeout_s=600)
    rows = [
        [tool, part, *_times(each)]
        for part, measured in found.items()
        for tool, each in measured["ms"].items()
        if tool != "analyze_can_log outside"
    ]
    return (
        f"## Beside Peykan {VERSION}\n\n"
        + table(["", "ours", "Peykan"], [list(row) for row in FEATURES])
        + "\n\nWhere the answers differ, theirs is at fault:\n\n"
        + table(["call", "Peykan"], [list(row) for row in THEIR_FAULTS.items()])
        + f"\n\nTime per call, both through the MCP SDK's client in one process, in turns ({ROUNDS} rounds, of logs "
        f"{ROUNDS // 4}):\n\n" + table(["call", "bus", "ours p50 ms", "Peykan p50 ms", "ours over Peykan"], rows)
    )


def _times(ms: Mapping[str, Any]) -> list[str]:
    ours, theirs = median(ms["ours"]), median(ms["theirs"])
    return [f"{ours:.1f}", f"{theirs:.1f}", f"{ours / theirs:.2f}"]
