"""A page that is opened late: the viewer's server gives it what is newest first."""

import os
import subprocess
import time
from pathlib import Path

import pytest
import rerun as rr
import rerun_cli  # type: ignore[import-untyped]

from services.logger.view.server import Server, free_port
from services.logger.view.settings import ViewSettings

WAIT_S, PICTURES, PICTURE_BYTES = 30.0, 600, 30_000


@pytest.mark.stack
def test_a_page_that_is_opened_late_is_given_the_present_before_the_past(tmp_path: Path) -> None:
    kept, pictures = tmp_path / "late.rrd", [os.urandom(PICTURE_BYTES) for _ in range(PICTURES)]
    with Server(ViewSettings(mode="web", port=free_port("127.0.0.1"))) as server:
        stream = rr.RecordingStream("drivemcp")
        stream.set_sinks(rr.GrpcSink(server.sink))
        for number, picture in enumerate(pictures):
            stream.set_time("tick", sequence=number)
            stream.log("camera/front", rr.EncodedImage(contents=picture, media_type="image/jpeg"))
        stream.flush()
        late = subprocess.Popen(
            [str(Path(rerun_cli.__file__).parent / "rerun"), server.sink, "--save", str(kept)],
            env={**os.environ, "XDG_CONFIG_HOME": str(tmp_path)}, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
        )  # fmt: skip
        try:
            before = _wait_for(kept, pictures[-1][:200])
        finally:
            late.kill()
            late.wait(WAIT_S)
            stream.disconnect()
    assert before < PICTURES * PICTURE_BYTES / 4


def _wait_for(path: Path, part: bytes) -> int:
    """How many bytes of the file stand before the part, once it is there."""
    until_s = time.monotonic() + WAIT_S
    while time.monotonic() < until_s:
        if path.exists() and (found := path.read_bytes().find(part)) >= 0:
            return found
        time.sleep(0.05)
    raise TimeoutError(f"{path} does not get what is newest")
