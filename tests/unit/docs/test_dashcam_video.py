"""The commands of the page "Your dashcam video", on a video of a drawn road."""

from pathlib import Path

import cv2
import numpy as np

from tests.unit.docs.page_commands import blocks, page, run

PAGE = page("tutorial/your-dashcam-video.md")


def film(path: Path) -> None:
    """Three seconds of a grey road below a pale sky, with marks that come nearer."""
    writer = cv2.VideoWriter(str(path), cv2.VideoWriter.fourcc(*"mp4v"), 10.0, (640, 360))
    for number in range(30):
        picture = np.full((360, 640, 3), 190, np.uint8)
        picture[180:] = 90
        for mark in range(8):
            y = 180 + (mark * 22 + number * 6) % 180
            cv2.rectangle(picture, (316, y), (324, y + 8), (230, 230, 230), -1)
        writer.write(picture)
    writer.release()


def test_a_video_is_played_seen_again_and_reported(tmp_path: Path) -> None:
    film(tmp_path / "dashcam.mp4")
    told = run(blocks(PAGE, "sh"), tmp_path, 360)
    assert "pictures rendered into seen.mp4" in told
    assert cv2.VideoCapture(str(tmp_path / "seen.mp4")).get(cv2.CAP_PROP_FRAME_COUNT) > 0
    assert told.count("messages              0 in") == 2
    assert "(verified)" in told
    assert list(tmp_path.glob("out/dashcam-track/*/report.html"))
