"""Two versions of a pack side by side as one HTML page, for a lawyer to read: words that changed are marked, nothing is fetched.

Elements are built, never strings: whatever a pack says stands on the page as text.
"""

import re
import unicodedata
from collections.abc import Iterable, Iterator, Mapping
from difflib import SequenceMatcher
from pathlib import Path
from xml.etree.ElementTree import Element, SubElement, tostring

from services.rules.authoring.diff import WARNED, differences, plain
from services.rules.authoring.wording import said, spaced
from services.rules.packs.format import Manifest, Provision, Sign
from services.rules.packs.loading import Pack

Entry = Manifest | Provision | Sign
Rows = dict[tuple[str, str], str]
"""What an entry says, by field and language (empty: none)."""
_STYLE = Path(__file__).with_name("diff_page.css")
_TOKEN = re.compile(r"\s+|\w+|[^\w\s]")
_LONGEST = 4000
"""Words and marks of a text that is compared word by word, which takes time by its square."""
_FIELDS = {
    Manifest: (
        "id", "version", "title", "jurisdiction", "effective_from", "effective_until", "units", "traffic_side", "languages", "precedence",
        "extends", "disclaimer",
    ),
    Provision: ("kind", "section", "url"),
    Sign: ("national", "section", "shape", "group", "action", "effect", "unit", "values", "words", "plate", "aliases"),
}  # fmt: skip


def page(old: Pack, new: Pack) -> str:
    """The whole page, without any link."""
    html = Element("html", lang="en")
    head, body = SubElement(html, "head"), SubElement(html, "body")
    SubElement(head, "meta", charset="utf-8")
    SubElement(head, "meta", name="viewport", content="width=device-width, initial-scale=1")
    policy = {"http-equiv": "Content-Security-Policy", "content": "default-src 'none'; style-src 'unsafe-inline'"}
    SubElement(head, "meta", policy)
    _text(head, "title", f"{old.version} and {new.version}")
    _text(head, "style", _STYLE.read_text(encoding="utf-8"))
    _text(body, "h1", "What changes in a rulepack")
    _sides(body, old, new)
    _summary(body, old, new)
    _details(body, "The pack", list(_changed({"manifest.json": old.manifest}, {"manifest.json": new.manifest})))
    _details(body, "Provisions", list(_changed(old.provisions, new.provisions)))
    _details(body, "Signs", list(_changed(old.signs, new.signs)))
    return "<!doctype html>\n" + tostring(html, encoding="unicode", method="html") + "\n"


def _sides(body: Element, old: Pack, new: Pack) -> None:
    table = _table(body, (("", ""), ("before", ""), ("now", "")))
    facts = (
        ("pack", old.version, new.version),
        ("title", old.manifest.title, new.manifest.title),
        ("content (SHA-256)", old.manifest.content_sha256, new.manifest.content_sha256),
    )
    for name, *sides in facts:
        row = SubElement(table, "tr")
        _text(row, "th", name, scope="row")
        for side in sides:
            _text(row, "td", side)
    _text(
        body, "p", "A restatement in the authors' own words, with what the texts demand; only the official texts bind."
    )


def _summary(body: Element, old: Pack, new: Pack) -> None:
    """As `drivemcp rulepack diff` says it; what raises a limit, or may, is marked and counted."""
    found = differences(old, new)
    lines = [line for part in found for line in part.lines]
    warned = sum(any(word in line for word in WARNED) for line in lines)
    _text(body, "h2", "In words")
    told = f"{len(lines)} changes for a driver; {warned} raise a limit or may."
    _text(body, "p", told if lines else "Nothing changes for a driver.", **({"class": "warned"} if warned else {}))
    for part in found:
        _text(body, "h3", part.heading)
        listed = SubElement(body, "ul")
        for line in part.lines:
            _text(listed, "li", line, **({"class": "warned"} if any(word in line for word in WARNED) else {}))


def _changed(before: Mapping[str, Entry], after: Mapping[str, Entry]) -> Iterator[tuple[str, Rows | None, Rows | None]]:
    """Entries that differ, in the new pack's order, then those that are gone."""
    for name in (*after, *(name for name in before if name not in after)):
        was, now = (_rows(side[name]) if name in side else None for side in (before, after))
        if was != now:
            yield name, was, now


def _details(body: Element, heading: str, found: list[tuple[str, Rows | None, Rows | None]]) -> None:
    _text(body, "h2", heading)
    if heading != "The pack" or not found:
        _text(body, "p", f"{len(found)} changed." if found else "Unchanged.")
    for name, was, now in found:
        state = "new" if was is None else "gone" if now is None else ""
        table = _table(body, ((_called(name, was, now), state), ("before", ""), ("now", "")))
        both = {**(now or {}), **(was or {})}
        for field, language in both:
            before, after = (side.get((field, language), "") if side else "" for side in (was, now))
            if before == after:
                continue
            row = SubElement(table, "tr")
            _text(row, "th", f"{field} ({language})" if language else field, scope="row")
            tongue = {"lang": language} if language else {}
            cells = SubElement(row, "td", tongue), SubElement(row, "td", tongue)
            _marked(cells[0], cells[1], before, after)


def _called(name: str, *sides: Rows | None) -> str:
    """The id, below the place in the law."""
    place = next((side["section", ""] for side in reversed(sides) if side and ("section", "") in side), "")
    return f"{place}\n{name}" if place else name


def _table(body: Element, heads: Iterable[tuple[str, str]]) -> Element:
    table = SubElement(SubElement(body, "div", {"class": "entry"}), "table")
    row = SubElement(SubElement(table, "thead"), "tr")
    for text, state in heads:
        cell = _text(row, "th", f"{text} " if state else text, scope="col")
        if state:
            _text(cell, "mark", state)
    return SubElement(table, "tbody")


def _marked(left: Element, right: Element, before: str, after: str) -> None:
    """Words that only one side has, marked where both sides have any; texts of more than `_LONGEST` tokens stand as they are."""
    was, now = (_TOKEN.findall(_visible(text)) for text in (before, after))
    if not was or not now or max(len(was), len(now)) > _LONGEST:
        left.text, right.text = "".join(was), "".join(now)
        return
    for how, a, b, c, d in SequenceMatcher(None, was, now, autojunk=False).get_opcodes():
        for cell, tag, part in ((left, "del", "".join(was[a:b])), (right, "ins", "".join(now[c:d]))):
            _add(cell, "" if how == "equal" and part.strip() else tag, part)


def _add(cell: Element, tag: str, text: str) -> None:
    if not text:
        return
    if tag:
        SubElement(cell, tag).text = text
    elif len(cell):
        cell[-1].tail = (cell[-1].tail or "") + text
    else:
        cell.text = (cell.text or "") + text


def _rows(entry: Entry) -> Rows:
    said_of = {
        field: plain(found) for field in _FIELDS[type(entry)] if (found := getattr(entry, field)) not in (None, ())
    }
    rows: Rows = {(spaced(field), ""): text for field, text in said_of.items()}
    if isinstance(entry, Manifest):
        spans = entry.plausible_limits
        return rows | {(f"limits believed, {spaced(road)}", ""): plain(span) for road, span in spans.items()}
    if isinstance(entry, Provision):
        rows["demands", ""] = "\n".join(said(effect) for effect in entry.effects)
        texts = {"searched by": entry.topics}
    else:
        rows["law", ""] = ", ".join(entry.provisions)
        texts = {"meaning": entry.meaning, "note": entry.note}
    texts = {"text": {source.language: source.excerpt for source in entry.sources}, **texts}
    return rows | {(field, language): text for field, by in texts.items() for language, text in by.items()}


def _text(parent: Element, tag: str, text: str, **attributes: str) -> Element:
    made = SubElement(parent, tag, attributes)
    made.text = text if tag == "style" else _visible(text)
    return made


def _visible(text: str) -> str:
    """Characters that show nothing, or turn the order of others, as their numbers: a reader sees what is there."""
    return "".join(
        f"[U+{ord(each):04X}]"
        if unicodedata.category(each) in ("Cc", "Cf", "Co", "Cs") and each not in "\n\t\u00ad"
        else each
        for each in text
    )
