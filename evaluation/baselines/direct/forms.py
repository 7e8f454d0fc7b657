"""What can be advised, and the sentences that a language model is asked for.

One table for the prompt that lists them, for the grammar that decoding can be held to, and for the parser that understands them.
"""

import re
from collections.abc import Iterable
from typing import Literal, NamedTuple

from proto.scene import Unit
from services.drivelm.vocabulary.jurisdictions import allowed_limits

Action = Literal["stop", "hazard", "give_way", "limit", "limit_ahead", "slow", "none"]
N = r"(?P<value>[1-9][0-9]{0,2}) (?P<unit>km/h|mph)"
"""A number and its unit, as a pattern."""


class Form(NamedTuple):
    """One sentence; `{n}` stands for a number and its unit."""

    text: str
    action: Action
    hazard: str = ""

    def pattern(self) -> re.Pattern[str]:
        """The sentence in lower case, without its full stop."""
        before, numbered, after = self.text.lower().rstrip(".").partition("{n}")
        return re.compile(re.escape(before) + (N if numbered else "") + re.escape(after))


FORMS: tuple[Form, ...] = (
    Form("Drive at most {n}.", "limit"),
    Form("The speed limit ahead is {n}.", "limit_ahead"),
    Form("Slow down.", "slow"),
    Form("Stop.", "stop"),
    Form("Give way.", "give_way"),
    Form("A vehicle is ahead in the path.", "hazard", "closing_lead"),
    Form("A pedestrian is ahead in the path.", "hazard", "pedestrian"),
)
ABSTENTION = "I do not know."
UNITS: tuple[Unit, ...] = ("km/h", "mph")


def listed() -> str:
    """The sentences as a prompt lists them, a line each."""
    return "\n".join(
        form.text.format(n=f"N {unit}") for form in FORMS for unit in (UNITS if "{n}" in form.text else ("",))
    )


def grammar() -> str:
    """The same in GBNF: after a blank the abstention, or one sentence or two; then the line ends. Numbers are those that signs show."""
    sentences = (_quoted(form.text).replace("{n}", '" n "') for form in FORMS)
    numbers = (
        f"({_any(str(value) for value in sorted(allowed_limits(None, unit)))}) {_quoted(f' {unit}')}" for unit in UNITS
    )
    return "\n".join(
        (
            f"root ::= \" \" ({_quoted(ABSTENTION)} | sentence (\" \" sentence)?) end",
            f"sentence ::= {' | '.join(sentences)}",
            f"n ::= {' | '.join(numbers)}",
            'end ::= "\\n" | "\\n\\n"',
            "",
        )
    )  # fmt: skip


def _any(texts: Iterable[str]) -> str:
    return " | ".join(map(_quoted, texts))


def _quoted(text: str) -> str:
    return f'"{text}"'
