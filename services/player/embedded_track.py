"""Positions that a camera wrote into its video: GoPro, Insta360, Sony, and what keeps to CAMM, by the package telemetry-parser.

That parser is compiled code, and a broken file ends its process. It runs in a process of its own, with limits of time and memory.
"""

import importlib.util
import json
import resource
import struct
import subprocess
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import cv2

from domain.units import MPS_PER, MPS_PER_KNOT
from drivemcp.errors import UserError

SUFFIXES = (".mp4", ".mov", ".360", ".insv")
Row = tuple[float, float, float, float | None, float | None]
"""Seconds from the video's start, latitude and longitude in degrees, speed in m/s, course in degrees from north; None: not told."""
Groups = Mapping[str, Mapping[str, Any]]
"""What the package tells of one sample of the metadata track: values by group and tag."""
LONGEST_S, MOST_BYTES = 60.0, 4 << 30
PAYLOAD_S = 1.0
"""GoPro and Sony tell no time beside a position. Samples lie evenly in the video, and so far apart where its length is unknown."""
FIX_2D = 2
GPS9 = ">7i2H"
"""GoPro HERO11 and HERO13: latitude, longitude, altitude, speeds over ground and in space, days, seconds, precision, fix."""
SINCE_1970_S = 1e8


def embedded_rows(video: Path) -> list[Row]:
    """The positions inside a video, none where it holds none. Raises UserError where they cannot be read."""
    if importlib.util.find_spec("telemetry_parser") is None:
        return []
    command = [sys.executable, "-m", "services.player.embedded_track", str(video)]
    try:
        done = subprocess.run(command, capture_output=True, timeout=LONGEST_S, check=True)
        rows: list[Row] = [tuple(row) for row in json.loads(done.stdout)]
    except (subprocess.SubprocessError, OSError, ValueError):
        raise UserError(f"{video}: its telemetry cannot be read") from None
    return rows


def rows_of(samples: Sequence[Groups], duration_s: float) -> Iterator[Row]:
    """The positions in what the package tells. Raises KeyError, TypeError, ValueError or struct.error where that is of another form."""
    listed = [row for groups in samples for row in _listed(groups.get("GPS", {}).get("Data"))]
    start_s = min((row["unix_timestamp"] for row in listed), default=0.0)
    start_s = start_s if start_s > SINCE_1970_S else 0.0  # CAMM's shorter form counts from the video's start
    told = any(row["speed"] for row in listed)
    for row in (row for row in listed if row["is_acquired"]):
        moving = (row["speed"] * MPS_PER["km/h"], row["track"]) if told else (None, None)
        yield row["unix_timestamp"] - start_s, row["lat"], row["lon"], *moving
    placed = [groups for groups in samples if "GPS" in groups or "GPS9" in groups]
    period_s = duration_s / len(placed) if duration_s > 0 and placed else PAYLOAD_S
    for number, groups in enumerate(placed):
        found = [*_gopro(groups), *_sony(groups.get("GPS", {}))]
        for share, (latitude, longitude, speed) in enumerate(found):
            yield (number + share / len(found)) * period_s, latitude, longitude, speed, None


def _listed(data: Any) -> list[Mapping[str, Any]]:
    """Insta360's and CAMM's positions are told one by one, with their times."""
    return data if isinstance(data, list) and data and isinstance(data[0], dict) else []


def _gopro(groups: Groups) -> Iterator[tuple[float, float, float]]:
    """Where the receiver has a fix: GPS5 in scaled integers with one fix for all, GPS9 as bytes with a fix for each."""
    if raw := groups.get("GPS9", {}).get("0x47505339"):
        scales = groups["GPS9"]["Scale"]
        values = [row for row in struct.iter_unpack(GPS9, bytes(raw[8:])) if row[8] >= FIX_2D]
    else:
        gps = groups.get("GPS", {})
        rows, scales = gps.get("Data") or [], gps.get("Scale")
        fixed = scales and not _listed(rows) and gps.get("0x47505346", 0) >= FIX_2D
        values = rows if fixed else []
    for latitude, longitude, _, speed, *_ in values:
        yield latitude / scales[0], longitude / scales[1], speed / scales[3]


def _sony(gps: Mapping[str, Any]) -> Iterator[tuple[float, float, float | None]]:
    if gps.get("GPSStatus") == ord("A") and "GPSLatitude" in gps:
        names = ("GPSLatitude", "GPSLongitude")
        latitude, longitude = (sum(part / 60**power for power, part in enumerate(gps[name])) for name in names)
        south, west = gps["GPSLatitudeRef"] == ord("S"), gps["GPSLongitudeRef"] == ord("W")
        unit = {ord("K"): MPS_PER["km/h"], ord("M"): MPS_PER["mph"], ord("N"): MPS_PER_KNOT}.get(
            gps.get("GPSSpeedRef", 0)
        )
        speed = gps["GPSSpeed"] * unit if unit and "GPSSpeed" in gps else None
        yield -latitude if south else latitude, -longitude if west else longitude, speed


def main(video: str) -> None:
    """Write the positions inside a video as JSON."""
    import telemetry_parser

    resource.setrlimit(resource.RLIMIT_AS, (MOST_BYTES, MOST_BYTES))
    try:
        samples = telemetry_parser.Parser(video).telemetry()
    except (OSError, ValueError):  # no camera that it knows, or no metadata
        samples = []
    capture = cv2.VideoCapture(video) if samples else None
    rate_hz = capture.get(cv2.CAP_PROP_FPS) if capture is not None else 0.0
    duration_s = capture.get(cv2.CAP_PROP_FRAME_COUNT) / rate_hz if capture is not None and rate_hz > 0 else 0.0
    json.dump(list(rows_of(samples, duration_s)), sys.stdout)


if __name__ == "__main__":
    main(sys.argv[1])
