"""Shows logs that were written before: the same records through the same drawing."""

import threading
from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from pathlib import Path

from drivemcp.errors import UserError
from proto import topics
from services.logger.format.reader import messages, topic_of
from services.logger.view.pipe import SHOWN_TOPICS, Thinning, ViewPipe
from services.logger.view.settings import Said, Shown, ViewSettings

START_S = 30.0


def show(
    paths: Sequence[Path], *, recording: str, bind: str, web_port: int, image_hz: float, say: Callable[[str], None]
) -> int:
    """Serves the logs, one behind the other, until interrupted, or writes them as one recording.

    Raises UserError where nothing can be shown.
    """
    names = ", ".join(map(str, paths))
    said: list[Said] = []
    heard = threading.Event()

    def hear(what: Said) -> None:
        said.append(what)
        heard.set()

    settings = ViewSettings(
        mode="file" if recording else "web", bind=bind, web_port=web_port, image_hz=image_hz, recording=recording
    )
    pipe = ViewPipe(settings, said=hear)
    try:
        heard.wait(START_S)
        if not said or said[0].problem:
            raise UserError(f"the viewer does not start: {said[0].problem if said else 'no answer'}")
        shown = feed(paths, pipe, image_hz)
        if shown == 0:
            raise UserError(f"{names}: nothing in it can be shown")
        say(f"{shown} records of {names}: {said[0].viewer}")
        if not recording:
            say("Ctrl-C ends")
            return pipe.wait_ended()
    except KeyboardInterrupt:
        say("")
    finally:
        pipe.close(drain=True, timeout_s=20.0)
    return 0


def feed(paths: Iterable[Path], pipe: ViewPipe, image_hz: float) -> int:
    """Every record that is shown, in order; how many."""
    pictures, count = Thinning(image_hz), 0
    for logged in chain.from_iterable(map(messages, paths)):
        topic = topic_of(logged.name)
        if topic is None or topic.name not in SHOWN_TOPICS:
            continue
        if topic.name == topics.CAMERA.name and not pictures.passes(logged.name, logged.stamp_ns):
            continue
        pipe.send(Shown(topic=topic.name, name=logged.name, stamp_ns=logged.stamp_ns, data=logged.data), wait=True)
        count += 1
    return count
