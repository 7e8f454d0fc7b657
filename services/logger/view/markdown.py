"""Text of others in a document of ours: shown as it is, never as a heading, a link, a picture or bold."""

import re

_PUNCTUATION = re.compile(r"([!-/:-@\[-`{-~])")


def literal(text: str) -> str:
    """One line of Markdown that shows the text, in which a backslash stands before all that Markdown could take for its own."""
    return _PUNCTUATION.sub(r"\\\1", " ".join(text.split()))
