"""Writes the words that a rulepack may use: `python scripts/vocabulary.py`. `scripts/reference` makes their page of the same."""

import sys
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import get_args

import msgspec

ROOT = Path(__file__).parents[1]
if __name__ == "__main__":
    sys.path.insert(0, str(ROOT))

from proto.rules import LegalAction, VehicleClass  # noqa: E402
from proto.scene import Unit  # noqa: E402
from scripts.reference.markdown import page  # noqa: E402
from services.drivelm.vocabulary.classes import LIGHTS, OTHER, READER_CLASSES  # noqa: E402
from services.rules.authoring import vocabulary as words  # noqa: E402
from services.rules.packs.format import Condition, Lane, Prohibition, Provision, RightOfWay, RoadType, Sign  # noqa: E402
from services.rules.right_of_way import CROSSINGS, REPLACED_BY_LIGHTS  # noqa: E402
from services.rules.signs.sign_codes import parse_reading  # noqa: E402

READ = frozenset(parse_reading(name).code for name in READER_CLASSES if name not in (OTHER, *LIGHTS))
"""Codes that the front end's reader writes."""


def in_use() -> words.Vocabulary:
    """The words of the shipped packs, of the reader and of the service."""
    folders = sorted(path.parent for path in (ROOT / "rulepacks").glob("*/manifest.json"))
    provisions = [entry for f in folders for entry in _entries(f / "provisions.json", Provision)]
    signs = [entry for f in folders for entry in _entries(f / "signs.json", Sign)]
    effects = [effect for provision in provisions for effect in provision.effects]
    codes = {code for sign in signs for code in (sign.code, *sign.aliases)} | READ | CROSSINGS | REPLACED_BY_LIGHTS
    triggers = {effect.trigger for effect in effects if isinstance(effect, RightOfWay)}
    codes |= {effect.sign for effect in effects if isinstance(effect, Prohibition) and effect.sign}
    codes |= {trigger.removeprefix(words.SIGN) for trigger in triggers if trigger.startswith(words.SIGN)}
    return words.Vocabulary(
        conditions=_sorted({e.what for e in effects if isinstance(e, Condition)} | set(words.CONDITIONS)),
        prohibitions=_sorted({e.what for e in effects if isinstance(e, Prohibition)} | set(words.PROHIBITIONS)),
        signs=_sorted(codes),
    )


def as_json(found: words.Vocabulary) -> bytes:
    """The file's content."""
    return msgspec.json.format(msgspec.json.encode(found)) + b"\n"


def as_page() -> str:
    """The page's content."""
    found = in_use()
    named = "Named by shipped packs, for people; no service acts by them"
    kinds = {"Plates": "plate:", "Markings": "marking:", "Gantries": "led:", "Information": "info:"}
    of_kind = {title: [code for code in found.signs if code.startswith(head)] for title, head in kinds.items()}
    others = [code for code in found.signs if not any(code in codes for codes in of_kind.values())]
    parts = [
        "`drivemcp rulepack validate` refuses any other word and names the nearest ones. "
        f"A word of a pack's own begins with `{words.OWN}`: no service acts by it and no reader writes it.",
        "## Triggers (`right_of_way.trigger`)",
        f"{_listed(words.TRIGGERS)}, and `sign:CODE` for every code below.",
        "## Conditions (`condition.what`)",
        _table("condition", "what the Rules service does", words.CONDITIONS),
        f"{named}: {_listed(word for word in found.conditions if word not in words.CONDITIONS)}.",
        "## Prohibitions (`prohibition.what`)",
        _table("prohibition", "what the Rules service does", words.PROHIBITIONS),
        f"{named}: {_listed(word for word in found.prohibitions if word not in words.PROHIBITIONS)}.",
        "`duty.what` is a free name.",
        "## Sign codes (`code`, `prohibition.sign`)",
        "Codes in bold are those that the front end's reader writes. `drivemcp rulepack show DEU-v1 CODE` shows one in full.",
        *(f"{title}: {_listed(codes, READ)}." for title, codes in {"Signs": others, **of_kind}.items()),
        "## Units, languages and closed lists",
        _table("field", "values", {
            "`units`, `unit`": _listed(get_args(Unit)),
            "`languages`": "two letters of ISO 639-1; every text of a pack is in one of its languages",
            "`action`": _listed(get_args(LegalAction)),
            "`road_types`": _listed(get_args(RoadType)),
            "`vehicle_classes`, `classes`": _listed(get_args(VehicleClass)),
            "`lanes`": _listed(get_args(Lane)),
        }, code=False),
    ]  # fmt: skip
    return page("Words of a rulepack", *parts)


def _entries(path: Path, kind: type) -> list:  # type: ignore[type-arg]
    return msgspec.json.decode(path.read_bytes(), type=list[kind])  # type: ignore[valid-type]


def _sorted(found: Iterable[str]) -> tuple[str, ...]:
    return tuple(sorted(word for word in found if not word.startswith(words.OWN)))


def _listed(found: Iterable[str], bold: Iterable[str] = ()) -> str:
    return ", ".join(f"**`{word}`**" if word in bold else f"`{word}`" for word in found)


def _table(name: str, says: str, rows: Mapping[str, str], *, code: bool = True) -> str:
    lines = [f"| {f'`{left}`' if code else left} | {right} |" for left, right in rows.items()]
    return "\n".join([f"| {name} | {says} |", "|---|---|", *lines])


def main() -> int:
    """Write the list."""
    found = in_use()
    words.FILE.write_bytes(as_json(found))
    sys.stdout.write(f"{words.FILE}\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
