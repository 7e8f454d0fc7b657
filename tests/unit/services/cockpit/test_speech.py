"""What the machine speaks: the words that were decided, an alarm before anything, nothing that is out of date."""

import json
import logging
import shutil
import stat
import threading
import time
import wave
from functools import partial
from pathlib import Path
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from drivemcp.bus.session import wait_settled
from drivemcp.errors import ConfigError
from drivemcp.testing import bus
from proto import topics
from services.cockpit.service import SERVICE, CockpitConfig
from services.cockpit.speech.commands import filled, speech_command
from services.cockpit.speech.tones import RATE_HZ, TONES, samples
from services.cockpit.speech.voice import STALE_S, Utterance, Voice, cleaned
from tests.unit.services.cockpit.messages import SILENT, assistance, told

SPOKEN = pytest.mark.skipif(
    shutil.which("espeak-ng") is None, reason="espeak-ng is not installed (apt-get install espeak-ng)"
)


class Stage:
    """A mouth that says what it is told to, as long as it is told to."""

    def __init__(self) -> None:
        self.begun: list[str] = []
        self.cut: list[str] = []
        self.let_go = threading.Event()
        self.changed = threading.Condition()

    def say(self, utterance: Utterance, cut: threading.Event) -> None:
        """Until it is cut or let go."""
        with self.changed:
            self.begun.append(utterance.text)
            self.changed.notify_all()
        while not self.let_go.is_set():
            if cut.wait(0.005):
                self.cut.append(utterance.text)
                return

    def close(self) -> None:
        """Nothing is held."""

    def wait_for(self, *texts: str) -> None:
        """Until these were begun."""
        with self.changed:
            assert self.changed.wait_for(lambda: set(texts) <= set(self.begun), 10.0), self.begun


def utterance(text: str, urgency: Any = "advice", **fields: Any) -> Utterance:
    """Words."""
    return Utterance(text=text, urgency=urgency, **fields)


def test_an_alarm_cuts_what_is_spoken_and_what_waits() -> None:
    stage = Stage()
    voice = Voice(stage, logging.getLogger("test"))
    voice.say(utterance("first"))
    stage.wait_for("first")
    voice.say(utterance("second"))
    voice.say(utterance("Brake!", "alarm"))
    stage.wait_for("Brake!")
    assert stage.cut == ["first"]
    stage.let_go.set()
    voice.say(utterance("third"))
    stage.wait_for("third")
    voice.close()
    assert stage.begun == ["first", "Brake!", "third"]


def test_advice_waits_its_turn_and_is_dropped_when_it_is_out_of_date() -> None:
    stage = Stage()
    voice = Voice(stage, logging.getLogger("test"))
    voice.say(utterance("first"))
    stage.wait_for("first")
    voice.say(utterance("old", asked_s=time.monotonic() - 2 * STALE_S))
    voice.say(utterance("new"))
    stage.let_go.set()
    stage.wait_for("new")
    voice.close()
    assert stage.begun == ["first", "new"]
    assert stage.cut == []


def test_no_words_are_no_speech_and_a_failure_ends_no_voice() -> None:
    class Broken(Stage):
        def say(self, utterance: Utterance, cut: threading.Event) -> None:
            super().say(utterance, cut)
            if utterance.text == "broken":
                raise OSError("no sound device")

    stage = Broken()
    stage.let_go.set()
    voice = Voice(stage, logging.getLogger("test"))
    for text in ("", "broken", "after"):
        voice.say(utterance(text))
    stage.wait_for("after")
    voice.close()
    assert stage.begun == ["broken", "after"]


@given(st.text(max_size=300))
def test_no_text_is_an_option_or_holds_what_is_no_letter(text: str) -> None:
    words = cleaned(text)
    assert words == cleaned(words)
    assert len(words) <= 120
    assert words.isprintable()
    assert not words.startswith(("-", "/"))


@given(st.text(max_size=60), st.text(max_size=20))
def test_a_placeholder_is_filled_inside_its_own_argument_and_never_twice(text: str, language: str) -> None:
    assert filled(("say", "-l", "{language}", "x{text}y{other}"), text=text, language=language) == [
        "say", "-l", language, f"x{text}y{{other}}",
    ]  # fmt: skip


def test_a_command_that_is_not_there_or_takes_no_text_is_told() -> None:
    with pytest.raises(ConfigError, match="apt-get install espeak-ng"):
        speech_command("no-such-command-here {text}")
    with pytest.raises(ConfigError, match="text"):
        speech_command("sh -c true")
    with pytest.raises(ConfigError, match="wav"):
        speech_command("sh -c {text}", recorded=True)


def test_a_graver_tone_is_faster_and_higher_and_louder() -> None:
    assert samples("info") == samples("advice") == b""
    warning, alarm = TONES["warning"], TONES["alarm"]
    assert alarm.hz > warning.hz
    assert alarm.pulse_s + alarm.gap_s < warning.pulse_s + warning.gap_s
    assert alarm.loudness > warning.loudness
    assert len(samples("warning")) == 4 * int(0.1 * RATE_HZ) * 2


def script(folder: Path, body: str) -> str:
    """A command that speaks into a file."""
    file = folder / "speak"
    file.write_text(f"#!/bin/sh\n{body}\n")
    file.chmod(file.stat().st_mode | stat.S_IXUSR)
    return str(file)


def test_a_text_reaches_the_command_as_one_argument_and_no_shell(tmp_path: Path) -> None:
    command = script(tmp_path, f'printf "%s|%s|" "$1" "$2" >> {tmp_path}/said')
    with bus() as b:
        b.start(SERVICE, CockpitConfig(speak=True, speech_command=f"{command} {{text}} {{language}}"))
        words = '$(touch x); "`id`" {language}'
        b.probe.publish(topics.ADVISORY, SILENT)
        b.probe.publish(topics.ADVISORY, told(words, language="de"))
        said = tmp_path / "said"
        assert wait_settled(lambda: said.exists() and said.read_text() == f"{words}|de|", 10.0)


def spoken(folder: Path) -> list[dict[str, Any]]:
    """The lines beside the recording."""
    file = folder / "spoken.jsonl"
    return [json.loads(line) for line in file.read_text().splitlines()] if file.exists() else []


@SPOKEN
def test_the_words_in_the_recording_are_those_decided_and_an_alarm_ends_what_is_spoken(tmp_path: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, CockpitConfig(wav=str(tmp_path)))
        b.probe.publish(topics.ADVISORY, told("70 when wet", tick=1))
        assert wait_settled(lambda: len(spoken(tmp_path)) == 1, 15.0)
        b.probe.publish(topics.ADVISORY, SILENT)
        long = "Great Britain: keep left, twenty miles an hour, and give way to all that comes from the right"
        b.probe.publish(topics.ADVISORY, told(long, "info", tick=2, language="en"))
        time_of_alarm = threading.Event()
        time_of_alarm.wait(0.6)  # the long sentence is being spoken: it takes several seconds
        b.probe.publish(topics.ADVISORY, told("Bremsen!", "alarm", tick=3, language="de"))
        assert wait_settled(lambda: [line["tick"] for line in spoken(tmp_path)][-1] == 3, 15.0)
        node.close()
    lines = spoken(tmp_path)
    assert [line["text"] for line in lines if not line["cut"]] == ["70 when wet", "Bremsen!"]
    assert all(line["text"] == long for line in lines if line["cut"])
    assert all(line["after_s"] < line["length_s"] for line in lines if not line["cut"])
    with wave.open(str(tmp_path / "spoken.wav")) as wav:
        assert wav.getframerate() == RATE_HZ
        seconds = wav.getnframes() / RATE_HZ
        last = lines[-1]
        assert seconds == pytest.approx(last["begins_s"] + last["length_s"], abs=0.01)
        wav.setpos(int(last["begins_s"] * RATE_HZ))
        assert any(wav.readframes(2000)), "the tone is heard before the words"


@SPOKEN
def test_an_overspeed_is_heard_when_it_begins_to_sound_and_not_when_muted(tmp_path: Path) -> None:
    with bus() as b:
        node = b.start(SERVICE, CockpitConfig(wav=str(tmp_path)))
        for warning, muted in (
            ("sounded", True),
            ("none", False),
            ("shown", False),
            ("sounded", False),
            ("sounded", False),
        ):
            b.probe.publish(topics.SPEED_ASSISTANCE, assistance(50, warning=warning, muted=muted))
        assert wait_settled(lambda: len(spoken(tmp_path)) == 1, 15.0)
        b.probe.publish(topics.ADVISORY, told("50", "info"))
        assert wait_settled(lambda: len(spoken(tmp_path)) == 2, 15.0)
        node.close()
    assert [(line["text"], line["urgency"]) for line in spoken(tmp_path)] == [("", "warning"), ("50", "info")]


@SPOKEN
def test_an_intervention_is_spoken_once_though_every_tick_brakes(tmp_path: Path) -> None:
    def last_is(words: str) -> bool:
        return [line["text"] for line in spoken(tmp_path)][-1:] == [words]

    with bus() as b:
        node = b.start(SERVICE, CockpitConfig(wav=str(tmp_path)))
        for words, hazard in (("Brake! Person", "pedestrian"), ("Foot on the brake", "held")):
            for tick in range(8):
                b.probe.publish(topics.ADVISORY, told(words, "alarm", kind="ACT", hazard=hazard, tick=tick))
            assert wait_settled(partial(last_is, words), 15.0)
        b.probe.publish(topics.ADVISORY, told("50", "info"))
        assert wait_settled(partial(last_is, "50"), 15.0)
        node.close()
    assert [line["text"] for line in spoken(tmp_path)] == ["Brake! Person", "Foot on the brake", "50"]
