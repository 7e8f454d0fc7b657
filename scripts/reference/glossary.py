"""Abbreviations of the pages, from the vocabulary of the language check."""

from scripts.prose.rules import ABBREVIATIONS
from scripts.reference.markdown import page, table


def glossary() -> str:
    """The page."""
    rows = [(name, says) for name, says in sorted(ABBREVIATIONS.items(), key=lambda row: row[0].casefold())]
    return page(
        "Glossary",
        "Abbreviations that the pages use. The check of language refuses others.",
        table(("short", "what it is"), rows),
    )
