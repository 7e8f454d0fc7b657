"""Binds the page and the voice to the bus: advisory, speed assistance and health in, the driver's touches out."""

import math
import time
from pathlib import Path
from typing import Any

import msgspec

from domain.hearing import Hearing
from drivemcp.bus.received import Received
from drivemcp.http.limits import App
from drivemcp.http.serving import HttpConfig, listen, serve, token_of
from drivemcp.node import Node
from drivemcp.service import Service
from proto import topics
from proto.decision import Advisory
from proto.speed_assistance import SpeedAssistance
from proto.tools import Outcome
from services.cockpit.app import make_app
from services.cockpit.entry import with_entry, with_own_origin
from services.cockpit.events import Stream
from services.cockpit.speech.commands import player_command, speech_command
from services.cockpit.speech.mouth import Device, Recorder
from services.cockpit.speech.voice import Mouth, Utterance, Voice, cleaned

GRACE_MS = 1500.0
"""Added to a tool's own deadline: a driver who touches waits for an answer, and no tick does."""
SOUND_PERIOD_S = 1.0
"""From pulses to pulses while an overspeed sounds."""
NEEDED = ("orchestrator",)
"""Services whose absence is a fault though they were never there."""


class CockpitConfig(HttpConfig, frozen=True, kw_only=True):
    """Where the page is served, and whether and how the machine speaks."""

    max_request_kb: int = 16
    speak: bool = False
    """The machine speaks (`drivemcp up --speak`); a page may speak as well, where its driver switches that on."""
    speech_command: str = ""
    """With {text} {language} {rate} {pitch} {volume}; one with {wav} writes a file that is played. Empty: `espeak-ng`."""
    player_command: str = ""
    """Plays a file, {wav}. Empty: the first of `pw-play`, `paplay`, `aplay` that is there."""
    wav: str = ""
    """A folder: all that is spoken goes into `spoken.wav` and `spoken.jsonl` in it, and to no sound device."""


class Cockpit:
    """What the pages and the voice are told."""

    def __init__(self, node: Node, voice: Voice | None) -> None:
        self._node = node
        self._voice = voice
        self._seen: set[str] = set(NEEDED)
        self._sounded_s = -math.inf
        self._hearing = Hearing()
        self.stream = Stream()

    def on_advisory(self, advisory: Advisory, info: Received[Advisory]) -> None:
        """Show it, and speak it where there is something to say."""
        told = advisory.kind != "SILENT"
        heard = self._hearing.hears(advisory, info.stamp_ns)
        self.stream.put(
            "advisory",
            {
                "tick": advisory.tick, "kind": advisory.kind, "directive": cleaned(advisory.directive) if told else "",
                "urgency": advisory.urgency, "topic": advisory.topic, "spoken": heard, "picture": advisory.picture if told else None,
                "language": advisory.language, "unit": advisory.unit,
                "justification": advisory.justification if told else "",
                "citations": advisory.citations if told else (), "degraded": advisory.degraded,
            },
        )  # fmt: skip
        if heard and self._voice is not None:
            self._voice.say(Utterance.of(advisory))

    def on_assistance(self, assistance: SpeedAssistance, info: Received[SpeedAssistance]) -> None:
        """Show it, and let an overspeed be heard as long as it sounds."""
        self.stream.put("speed", {**msgspec.to_builtins(assistance), "known": assistance.known})
        now_s = time.monotonic()
        if assistance.warning != "sounded" or assistance.muted or self._voice is None:
            self._sounded_s = -math.inf
        elif now_s - self._sounded_s >= SOUND_PERIOD_S:
            self._sounded_s = now_s
            self._voice.say(Utterance(text="", urgency="warning", tick=assistance.tick, stale_s=SOUND_PERIOD_S / 2))

    def on_second(self) -> None:
        """Tell which services are missing that were there."""
        alive = self._node.alive_services()
        self._seen |= alive
        self.stream.put("health", {"missing": sorted(self._seen - alive), "speaks": self._voice is not None})

    def call(self, tool: str, arguments: dict[str, Any]) -> Outcome:
        """One of the driver's tools."""
        entry = self._node.catalogue().get(tool)
        deadline_ms = GRACE_MS + (entry.meta.deadline_ms if entry is not None else 0.0)
        return self._node.call(tool, arguments, deadline_ms=deadline_ms)


def build(config: CockpitConfig, node: Node) -> None:
    """Listen in a thread of its own, and speak in another. Raises ConfigError on what cannot be had."""
    token = token_of(config)
    voice = _voice(config, node)
    cockpit = Cockpit(node, voice)
    node.watch_services()
    node.subscribe(topics.ADVISORY, cockpit.on_advisory)
    node.subscribe(topics.SPEED_ASSISTANCE, cockpit.on_assistance)
    node.every(1.0, cockpit.on_second)

    def guard(app: App) -> App:
        entered = with_entry(app, token) if token else app
        return with_own_origin(entered, config.allowed_hosts, any_host=bool(token))

    address = serve(node, config, listen(config), make_app(cockpit.stream, cockpit.call), guard)
    node.on_close(cockpit.stream.close)  # before the server ends: closers run from the last to the first
    node.detail["page"] = f"{address}/"


def _voice(config: CockpitConfig, node: Node) -> Voice | None:
    if not config.speak and not config.wav:
        return None
    speech = speech_command(config.speech_command, recorded=bool(config.wav))
    mouth: Mouth = (
        Recorder(speech, Path(config.wav)) if config.wav else Device(speech, player_command(config.player_command))
    )
    voice = Voice(mouth, node.log)
    node.on_close(voice.close)
    return voice


SERVICE = Service("cockpit", CockpitConfig, build)
