"""Each reader of foreign files, on files of its kind that were disturbed: it reads, or refuses in one line of its own words.

`FUZZ_EXAMPLES` says how many files each reader is tried on: a few in `make test`, as many as an hour takes in `make fuzz`.
"""

import json
import math
import os
from collections.abc import Callable
from datetime import UTC, datetime
from pathlib import Path
from typing import NamedTuple

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from drivemcp.errors import UserError
from drivemcp.files.bus_description import load_description
from drivemcp.files.can_logs.log import CanLog
from evaluation.baselines.direct.cassette import read as read_cassette
from services.perception.detect.detector import DetectorError
from services.perception.detect.loading import load_detector
from services.player.position_track import read_track
from services.rules.authoring.statutes.drafts import read_statute
from services.rules.errors import PackError
from services.weather.observations.observation import clean
from services.weather.sources import met_norway, metar, open_meteo
from services.weather.sources.provider import NS, UnusableAnswer
from studies.gvqa.answer import answers
from studies.gvqa.files import load, rows
from studies.gvqa.json_fields import UnreadableGraph
from studies.gvqa.pairing import pair

EXAMPLES = int(os.environ.get("FUZZ_EXAMPLES", "300"))
NOW_NS = int(datetime(2026, 1, 17, 22, 30, tzinfo=UTC).timestamp()) * NS
REFUSALS = (UserError, PackError, DetectorError, UnusableAnswer, UnreadableGraph)
FOREIGN = ("Traceback", "unpack", "invalid literal", "list index", "NoneType", "onnxruntime.capi")


class Target(NamedTuple):
    """A reader: its name of a file, files of its kind, and the reading."""

    file: str
    seeds: tuple[str, ...]
    read: Callable[[Path], object]


def read_can(path: Path) -> None:
    log, last_s = CanLog(path), 0.0
    for record in log:
        assert math.isfinite(record.at_s)
        assert record.at_s >= last_s, "time falls back"
        assert len(record.frame.data) <= 64
        last_s = record.at_s
    own(log.summary)
    own(log.nothing)


def read_weather(reader: Callable[..., object]) -> Callable[[Path], None]:
    def read(path: Path) -> None:
        told = reader(path.read_bytes(), NOW_NS)
        assert clean(told) is not None  # type: ignore[arg-type]

    return read


def read_answers(path: Path) -> None:
    document = load(path)
    answers(document)
    pair(document, rows(document))


def read_submission(path: Path) -> None:
    pair(load(path), rows(json.loads(DRIVELM)))


ASC = "base {} timestamps {}\nno internal events logged\n" + "".join(
    f"   {at} 1  100  Rx   d 8 10 0E 00 00 00 00 00 00\n" for at in ("-0.02", "0,00", "0.02", "0.04", "9999.0", "0.06")
)
CANDUMP = "".join(
    f"(17400000{n:02d}.0) can0 100#100E\n (17400000{n:02d}.5)  can1  100   [2]  10 0E\n" for n in range(9)
)
CSV = "timestamp,arbitration_id,extended,remote,error,dlc,data\n" + "0.1,0x100,0,0,0,15,EA4AAAAAAAA=\n" * 5
TRC = ";$FILEVERSION=1.1\n;$STARTTIME=45000.5\n" + "".join(
    f"  {n}) {n}0.1  Rx  0100 15  10 0E 00 00 00 00 00 00\n" for n in range(1, 6)
)
REPORTS = "METAR LOWX 172220Z NIL=\nMETAR LOWX 172150Z AUTO 24010KT 0800 4000N +FZRASN VV002 M01/M02 Q1001 REFZRA=\n"
HOURLY = {
    "time": [1768687200, 1768690800],
    "rain": [0.0, 5.0],
    "visibility": [None, None],
    "temperature_2m": [1.0, 0.5],
}
OPEN_METEO = json.dumps({"hourly_units": {"rain": "mm", "visibility": "undefined"}, "hourly": HOURLY})
MET_DATA = {
    "instant": {"details": {"air_temperature": 1.0}},
    "next_1_hours": {"details": {"precipitation_amount": 1.0}, "summary": {"symbol_code": "sleet"}},
}
MET_NORWAY = json.dumps(
    {
        "properties": {
            "meta": {"updated_at": "2026-01-17T21:00:00Z", "units": {"air_temperature": "celsius"}},
            "timeseries": [{"time": "2026-01-17T22:00:00Z", "data": MET_DATA}],
        }
    }
)
DRIVELM = json.dumps(
    {
        "s": {
            "key_frames": {
                "f": {
                    "QA": {"perception": [{"Q": "What is ahead?", "A": "A car.", "tag": [0]}]},
                    "key_object_infos": {},
                }
            }
        }
    }
)
SUBMISSION = json.dumps(
    {"method": "m", "team": "t", "results": [{"id": "s_f_0", "question": "What is ahead?", "answer": "A car."}]}
)
DBC = (
    'VERSION ""\nBU_: ECU\nBO_ 256 Motion: 8 ECU\n SG_ Speed : 0|16@1+ (0.01,0) [0|300] "km/h" ECU\n'
    ' SG_ Other : 8|16@1+ (1,0) [0|1] "" ECU\n'
)
GPX = '<gpx><trk><trkseg><trkpt lat="52.1" lon="13.1"><time>2026-01-17T22:00:00Z</time></trkpt></trkseg></trk></gpx>'
TRACK = "time,lat,lon,speed_kmh\n0.0,52.1,13.1,50\n1.0,52.2,13.1,51\n"
AKN = (
    '<akomaNtoso><act name="act"><preface><docTitle>A</docTitle></preface><body><section period="#t"><num>1.</num><intro><p>At most'
    "</p></intro><paragraph><num>(a)</num><content><p>60;</p></content></paragraph></section></body><attachments>"
    '<attachment status="removed"><p>80</p></attachment></attachments></act></akomaNtoso>'
)
CLML = (
    '<Legislation><Primary><Body><P1 id="section-1"><Pnumber>1</Pnumber><P1para><Text>At most</Text><P2 Status="Repealed"><Pnumber>1'
    "</Pnumber><P2para><Text>60</Text></P2para></P2></P1para></P1></Body></Primary></Legislation>"
)
CASSETTE = (
    '{"cassette":1}\n' + '{"backend":"b:1","prompt":"00","text":"Stop.","score":0.5,"took_ms":9.5,"tools":["t"]}\n' * 3
)
TARGETS = {
    "asc": Target("a.asc", (ASC.format("hex", "absolute"), ASC.format("dec", "relative")), read_can),
    "candump": Target("a.log", (CANDUMP,), read_can),
    "can csv": Target("a.csv", (CSV,), read_can),
    "trc": Target("a.trc", (TRC,), read_can),
    "blf": Target("a.blf", ("LOGG",), read_can),
    "bus description": Target("a.dbc", (DBC,), load_description),
    "track": Target("a.csv", (TRACK,), read_track),
    "gpx": Target("a.gpx", (GPX,), read_track),
    "metar": Target("a.txt", (REPORTS,), read_weather(metar.read)),
    "open-meteo": Target("a.json", (OPEN_METEO,), read_weather(open_meteo.read)),
    "met norway": Target("a.json", (MET_NORWAY,), read_weather(met_norway.read)),
    "detector": Target("a.onnx", ("", "version https://git-lfs\n", "<html>"), load_detector),
    "cassette": Target("a.jsonl", (CASSETTE,), read_cassette),
    "compressed cassette": Target("a.jsonl.gz", (CASSETTE,), read_cassette),
    "drivelm": Target("a.json", (DRIVELM,), read_answers),
    "submission": Target("a.json", (SUBMISSION,), read_submission),
    "statute": Target("a.xml", (AKN, CLML), read_statute),
}

_PIECES = st.one_of(
    st.binary(max_size=8),
    st.sampled_from(
        [
            b"\xef\xbb\xbf",
            b"\xff\xfe",
            b"\n",
            b"\r\n",
            b",",
            b".",
            b"-",
            b"//",
            b"NIL",
            b"null",
            b"{}",
            b"[]",
            b"1e999",
            b"\0",
        ]
    ),
)
"""What is put into a file."""


@st.composite
def disturbed(draw: st.DrawFn, target: Target) -> bytes:
    """A file of the kind with pieces put in, cut out, and lines told twice or in another order."""
    lines: list[bytes] = draw(st.sampled_from(target.seeds)).encode().splitlines(keepends=True)
    if draw(st.booleans()) and lines:
        lines = draw(st.lists(st.sampled_from(lines), max_size=2 * len(lines)))
    content = b"".join(lines)
    for _ in range(draw(st.integers(0, 4))):
        start = draw(st.integers(0, len(content)))
        stop = start + draw(st.integers(0, 6))
        content = content[:start] + draw(_PIECES) + content[stop:]
    return content[: draw(st.integers(0, len(content)))] if draw(st.integers(0, 9)) == 0 else content


def own(words: str) -> None:
    """One line that is not a library's."""
    assert "\n" not in words
    assert not any(each in words for each in FOREIGN), words


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("name", TARGETS)
def test_a_disturbed_file_is_read_or_refused_in_words(name: str, tmp_path_factory: pytest.TempPathFactory) -> None:
    target = TARGETS[name]
    path = tmp_path_factory.mktemp("fuzz") / target.file

    @settings(max_examples=EXAMPLES, deadline=None, suppress_health_check=list(HealthCheck))
    @given(disturbed(target))
    def reads(content: bytes) -> None:
        path.write_bytes(content)
        try:
            target.read(path)
        except REFUSALS as error:
            own(str(error))

    reads()
