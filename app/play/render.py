"""An annotated video from a drive's log: boxes with track ids and ranges, and what was said."""

import textwrap
from collections.abc import Iterable, Iterator
from pathlib import Path

import cv2
import msgspec
import numpy as np

from app.pictures import jpeg_of, unpacked
from drivemcp.errors import UserError
from drivemcp.pictures import FONT, Image, draw_boxes
from proto import topics
from proto.decision import Advisory
from proto.perception import Boxes
from proto.rules import LegalLimit
from services.logger.format.reader import messages

BANNER_PX, LINE_PX, MOST_LINES = 84, 18, 3
RATE_HZ = 10.0
CHARACTER_PX = 5.6
"""Of the banner's letters, in the mean of a line of reasons (5.1 to 5.5), and a little room."""


def render_video(logs: Iterable[Path], target: Path) -> int:
    """Write the front camera's pictures, annotated. Returns how many. Raises UserError when the logs hold none."""
    writer: cv2.VideoWriter | None = None
    written = 0
    for picture in annotated(logs):
        if writer is None:
            height, width = picture.shape[:2]
            writer = cv2.VideoWriter(str(target), cv2.VideoWriter.fourcc(*"mp4v"), RATE_HZ, (width, height))
            if not writer.isOpened():
                raise UserError(f"cannot write a video to {target}")
        writer.write(picture)
        written += 1
    if writer is None:
        raise UserError("the log holds no pictures of the front camera: nothing to render")
    writer.release()
    return written


def annotated(logs: Iterable[Path]) -> Iterator[Image]:
    """The pictures, each with the boxes of its own stamp and the advice that was given on it."""
    records = [record for log in logs for record in messages(log)]
    boxes = {
        record.stamp_ns: decoded
        for record in records
        if record.name == topics.BOXES.name
        and (decoded := msgspec.json.decode(record.data, type=Boxes)).camera == "front"
    }
    advice = {
        advisory.snapshot_stamp_ns: advisory
        for record in records
        if record.name == topics.ADVISORY.name
        for advisory in [msgspec.json.decode(record.data, type=Advisory)]
    }
    said: Advisory | None = None
    for record in records:
        if record.name != "sensor/camera/front":
            continue
        bgr = unpacked(jpeg_of(record.data))
        if bgr is None:
            continue
        now = advice.get(record.stamp_ns)
        said = now if now is not None and now.kind != "SILENT" else said
        yield draw(bgr, boxes.get(record.stamp_ns), now, said)


def draw(bgr: Image, boxes: Boxes | None, now: Advisory | None, said: Advisory | None) -> Image:
    """The picture with boxes, above a banner with the decision and the last thing said."""
    picture = bgr.copy()
    draw_boxes(picture, boxes)
    _show_limit(picture, now.legal_limit if now else None)
    banner = np.full((BANNER_PX, picture.shape[1], 3), 24, np.uint8)
    first = (
        f"{now.kind if now else 'no tick'}{'  degraded: ' + ', '.join(now.degraded) if now and now.degraded else ''}"
    )
    second = f"{said.directive} ({said.justification})" if said else "nothing said yet"
    for number, text in enumerate([first, *lines_of(second, picture.shape[1])]):
        place = (10, 20 + LINE_PX * number)
        cv2.putText(banner, text, place, FONT, 0.42, (235, 235, 235), 1, cv2.LINE_AA)
    return np.vstack([picture, banner])


SIGN_PX, RED, BLUE, DARK, WHITE = 34, (40, 40, 200), (180, 100, 30), (20, 20, 20), (250, 250, 250)
"""Radius and colours (BGR) of the limit in the picture's corner."""


def _show_limit(picture: Image, limit: LegalLimit | None) -> None:
    """The limit in force as a sign in the upper right corner: red ring, blue if recommended, grey with "?" if assumed or unknown."""
    centre = (picture.shape[1] - SIGN_PX - 12, SIGN_PX + 12)
    assumed = limit is None or limit.assumed
    ring = (150, 150, 150) if assumed else BLUE if limit is not None and limit.advisory else RED
    cv2.circle(picture, centre, SIGN_PX, ring, -1, cv2.LINE_AA)
    cv2.circle(picture, centre, SIGN_PX - 7, WHITE, -1, cv2.LINE_AA)
    text = (f"{limit.value:g}" if limit is not None else "") + ("?" if assumed else "")
    _centred(picture, text, centre, 0.85 if len(text) < 3 else 0.62)
    if limit is not None:
        _centred(picture, limit.unit, (centre[0], centre[1] + SIGN_PX + 12), 0.42)


def _centred(picture: Image, text: str, centre: tuple[int, int], scale: float) -> None:
    """Dark letters with a light edge, so that they are read on any ground."""
    (width, height), _ = cv2.getTextSize(text, FONT, scale, 2)
    place = (centre[0] - width // 2, centre[1] + height // 2)
    cv2.putText(picture, text, place, FONT, scale, WHITE, 4, cv2.LINE_AA)
    cv2.putText(picture, text, place, FONT, scale, DARK, 2, cv2.LINE_AA)


def lines_of(text: str, width_px: int) -> list[str]:
    """The text in lines that a picture has room for; what is left over ends in dots."""
    return textwrap.wrap(text, int((width_px - 20) / CHARACTER_PX), max_lines=MOST_LINES, placeholder=" ...")
