"""The sounds before urgent words, made here: two short pulses for a warning, four faster and higher ones for an alarm."""

import math
from array import array
from typing import NamedTuple

from proto.decision import Urgency

RATE_HZ = 22_050
"""Samples a second of everything that is spoken or sounded here."""
RAMP_S = 0.008
"""A pulse rises and falls in this time, so that it does not click."""


class Tone(NamedTuple):
    """Pulses of two partials."""

    pulses: int
    hz: float
    pulse_s: float
    gap_s: float
    loudness: float


TONES: dict[Urgency, Tone] = {
    "warning": Tone(pulses=2, hz=880.0, pulse_s=0.10, gap_s=0.10, loudness=0.45),
    "alarm": Tone(pulses=4, hz=1480.0, pulse_s=0.06, gap_s=0.04, loudness=0.8),
}
"""Faster, higher, louder: more urgent. Information and advice have none."""


def samples(urgency: Urgency) -> bytes:
    """Mono samples of 16 bits; empty where the urgency has no tone."""
    tone = TONES.get(urgency)
    if tone is None:
        return b""
    pulse, gap = _pulse(tone), array("h", bytes(2 * int(tone.gap_s * RATE_HZ)))
    return b"".join(pulse.tobytes() + gap.tobytes() for _ in range(tone.pulses))


def _pulse(tone: Tone) -> "array[int]":
    count = int(tone.pulse_s * RATE_HZ)
    made = array("h")
    for number in range(count):
        at_s = number / RATE_HZ
        ramp = min(1.0, at_s / RAMP_S, (count - 1 - number) / RATE_HZ / RAMP_S)
        wave = 0.8 * math.sin(math.tau * tone.hz * at_s) + 0.2 * math.sin(math.tau * 2 * tone.hz * at_s)
        made.append(round(32_000 * tone.loudness * ramp * wave))
    return made
