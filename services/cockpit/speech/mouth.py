"""Where words become sound: a sound device by the commands of this machine, or one WAV file."""

import subprocess
import tempfile
import threading
import time
import wave
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path
from typing import NamedTuple

import msgspec

from proto.decision import Urgency
from services.cockpit.speech.commands import filled
from services.cockpit.speech.tones import RATE_HZ, samples
from services.cockpit.speech.voice import Utterance

LOOK_S = 0.02
"""So often a process or a file that is being spoken is looked after: a cut takes no longer."""
LONGEST_S = 8.0
"""No command speaks longer; one that hangs is ended."""


class Prosody(NamedTuple):
    """Words a minute; pitch (0 to 99) and volume (0 to 200) as espeak-ng has them."""

    rate: int
    pitch: int
    volume: int


PROSODY: dict[Urgency, Prosody] = {
    "info": Prosody(150, 45, 90),
    "advice": Prosody(156, 50, 100),
    "warning": Prosody(160, 60, 130),
    "alarm": Prosody(170, 72, 170),
}


class Device:
    """By commands: one that writes a file and one that plays it, or one that does both."""

    def __init__(self, speech: Sequence[str], player: Sequence[str]) -> None:
        self._speech, self._player = speech, player

    def say(self, utterance: Utterance, cut: threading.Event) -> None:
        """The tone, while the words are made; then the words."""
        written = any("{wav}" in word for word in self._speech)
        with tempfile.TemporaryDirectory(prefix="drivemcp-voice-") as folder:
            tone, words = Path(folder) / "tone.wav", Path(folder) / "words.wav"
            making = begin(speech_of(self._speech, utterance, words)) if utterance.text and written else None
            if self._player and (sound := samples(utterance.urgency)):
                write_wav(tone, sound)
                finish(begin(filled(self._player, wav=tone)), cut)
            if making is not None:
                finish(making, cut)
            if utterance.text and not cut.is_set():
                command = filled(self._player, wav=words) if written else speech_of(self._speech, utterance, words)
                finish(begin(command), cut)

    def close(self) -> None:
        """Nothing is held."""


class Said(msgspec.Struct, frozen=True, kw_only=True):
    """A line of `spoken.jsonl`."""

    tick: int
    text: str
    urgency: Urgency
    language: str
    after_s: float
    """From the advisory to the first sample."""
    begins_s: float
    """In the recording."""
    length_s: float
    cut: bool


class Recorder:
    """A sound device that is a file: what is said takes its time in it, and ends where it is cut."""

    def __init__(self, speech: Sequence[str], folder: Path) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self._speech, self._folder = speech, folder
        self._began_s = time.monotonic()
        self._written = 0
        self._wav = wave.open(str(folder / "spoken.wav"), "wb")  # noqa: SIM115 closed by `close`
        self._wav.setparams((1, 2, RATE_HZ, 0, "NONE", ""))
        self._lines = (folder / "spoken.jsonl").open("wb")

    def say(self, utterance: Utterance, cut: threading.Event) -> None:
        """The tone, while the words are made, then the words, at their place in time."""
        with tempfile.TemporaryDirectory(prefix="drivemcp-voice-") as folder:
            file = Path(folder) / "words.wav"
            making = begin(speech_of(self._speech, utterance, file)) if utterance.text else None
            begins = self._record(samples(utterance.urgency), cut)
            if making is not None:
                finish(making, cut)
                words = self._record(read_wav(file) if not cut.is_set() else b"", cut)
                begins = words if begins is None else begins
        if begins is None:
            return
        said = Said(
            tick=utterance.tick, text=utterance.text, urgency=utterance.urgency, language=utterance.language,
            after_s=round(self._began_s + begins / RATE_HZ - utterance.asked_s, 4), begins_s=round(begins / RATE_HZ, 4),
            length_s=round((self._written - begins) / RATE_HZ, 4), cut=cut.is_set(),
        )  # fmt: skip
        self._lines.write(msgspec.json.encode(said) + b"\n")
        self._lines.flush()

    def _record(self, sound: bytes, cut: threading.Event) -> int | None:
        """Take the time of the sound, or less where it is cut. Returns its first sample's place; None without a sound."""
        if not sound or cut.is_set():
            return None
        now_s = time.monotonic()
        begins = max(self._written, int((now_s - self._began_s) * RATE_HZ))
        self._wav.writeframesraw(bytes(2 * (begins - self._written)))
        if cut.wait(len(sound) / 2 / RATE_HZ):
            sound = sound[: 2 * int((time.monotonic() - now_s) * RATE_HZ)]
        self._wav.writeframesraw(sound)
        self._written = begins + len(sound) // 2
        return begins

    def close(self) -> None:
        """Complete the file."""
        self._wav.close()
        self._lines.close()


def speech_of(command: Sequence[str], utterance: Utterance, file: Path) -> list[str]:
    """The command that speaks an utterance."""
    prosody = PROSODY[utterance.urgency]
    return filled(
        command, text=utterance.text, language=utterance.language, wav=file,
        rate=prosody.rate, pitch=prosody.pitch, volume=prosody.volume,
    )  # fmt: skip


def begin(command: list[str]) -> "subprocess.Popen[bytes]":
    """Start a command. Raises OSError."""
    quiet = subprocess.DEVNULL
    return subprocess.Popen(command, stdin=quiet, stdout=quiet, stderr=quiet)


def finish(process: "subprocess.Popen[bytes]", cut: threading.Event) -> None:
    """Wait for its end, or end it: when it is cut, or when it takes too long."""
    ends_s = time.monotonic() + LONGEST_S
    while process.poll() is None and time.monotonic() < ends_s and not cut.is_set():
        with suppress(subprocess.TimeoutExpired):
            process.wait(LOOK_S)
    if process.poll() is None:
        process.kill()
        process.wait()


def write_wav(file: Path, sound: bytes) -> None:
    """Mono samples of 16 bits as a WAV file."""
    with wave.open(str(file), "wb") as wav:
        wav.setparams((1, 2, RATE_HZ, 0, "NONE", ""))
        wav.writeframes(sound)


def read_wav(file: Path) -> bytes:
    """The samples of a WAV file that a command wrote; raises OSError where they are not as ours."""
    try:
        with wave.open(str(file), "rb") as wav:
            if (wav.getnchannels(), wav.getsampwidth(), wav.getframerate()) != (1, 2, RATE_HZ):
                raise OSError(f"a recording takes mono samples of 16 bits at {RATE_HZ} Hz")
            return wav.readframes(wav.getnframes())
    except (wave.Error, EOFError, FileNotFoundError) as error:
        raise OSError(f"the speech command wrote no WAV file: {error}") from None
