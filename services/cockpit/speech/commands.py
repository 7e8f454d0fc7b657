"""The commands that speak and play, out of the settings or as they are found on this machine. No shell sees any of them."""

import shlex
import shutil
from collections.abc import Sequence

from drivemcp.errors import ConfigError

ESPEAK = "espeak-ng -v {language} -s {rate} -p {pitch} -a {volume} -w {wav} -- {text}"
ALOUD = "espeak-ng -v {language} -s {rate} -p {pitch} -a {volume} -- {text}"
INSTALL = "apt-get install espeak-ng, or name another command: cockpit.speech_command"
PLAYERS = ("pw-play {wav}", "paplay {wav}", "aplay -q {wav}")


def speech_command(given: str, *, recorded: bool = False) -> tuple[str, ...]:
    """Raises ConfigError where the command is not there, or takes no text, or writes no file though it is recorded."""
    if not given and not recorded and not player_command(""):
        given = ALOUD  # it has a way of its own to the sound device; there are no tones then
    words = tuple(shlex.split(given or ESPEAK))
    if not words or shutil.which(words[0]) is None:
        raise ConfigError(f"speech_command: {words[0] if words else given!r} is not on the path; {INSTALL}")
    if not any("{text}" in word for word in words[1:]):
        raise ConfigError("speech_command: it has no argument with {text}")
    if recorded and not any("{wav}" in word for word in words[1:]):
        raise ConfigError("speech_command: what is to be recorded has to be written to {wav}")
    return words


def player_command(given: str) -> tuple[str, ...]:
    """What plays a file; empty: this machine has nothing. Raises ConfigError where the one that is named is not there."""
    for command in (given,) if given else PLAYERS:
        words = tuple(shlex.split(command))
        if shutil.which(words[0]) is not None:
            return words
    if given:
        raise ConfigError(f"player_command: {given.split()[0]} is not on the path")
    return ()


def filled(command: Sequence[str], **values: object) -> list[str]:
    """The command with its placeholders filled, each inside its own argument. Braces in the values stay as they are."""
    first, *rest = command
    return [first, *(_filled(word, values) for word in rest)]


def _filled(word: str, values: dict[str, object]) -> str:
    parts = word.split("{")
    made = parts[0]
    for part in parts[1:]:
        name, closed, after = part.partition("}")
        made += f"{values[name]}{after}" if closed and name in values else "{" + part
    return made
