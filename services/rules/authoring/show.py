"""A pack, a provision or a sign as text for the terminal."""

from collections.abc import Iterator

from services.rules.authoring.wording import said
from services.rules.errors import PackError
from services.rules.packs.format import Provision, Sign, Source
from services.rules.packs.loading import Pack


def shown(pack: Pack, name: str | None) -> str:
    """The whole pack in a line each, or one entry in full. Raises PackError for a name it does not have."""
    if name is None:
        return "\n".join(_overview(pack))
    if name in pack.provisions:
        return "\n".join(_provision(pack, pack.provisions[name]))
    code = name.removeprefix("sign:")
    found = next((sign for sign in pack.signs.values() if code in (sign.code, sign.national, *sign.aliases)), None)
    if found is None:
        raise PackError(f"{pack.manifest.id} has no provision or sign {name!r}; without a name all are listed")
    return "\n".join(_sign(pack, found))


def _overview(pack: Pack) -> Iterator[str]:
    m = pack.manifest
    yield f"{pack.version}: {m.title}"
    until = f" until {m.effective_until}" if m.effective_until else ""
    yield f"{m.jurisdiction}, in force from {m.effective_from}{until}, {m.units}, traffic on the {m.traffic_side}"
    if len(pack.family) > 1:
        yield f"extends {', '.join(pack.family[1:])}"
    yield f"{len(pack.provisions)} provisions, {len(pack.signs)} signs, {len(pack.cases)} cases, {', '.join(m.languages)}"
    yield ""
    for provision in pack.provisions.values():
        yield f"{provision.id:32} {provision.section:32} {'; '.join(said(effect) for effect in provision.effects)}"
    yield ""
    for sign in pack.signs.values():
        yield f"{sign.code:32} {sign.national:32} {sign.meaning.get('en', '')}"


def _provision(pack: Pack, provision: Provision) -> Iterator[str]:
    yield f"{provision.id}: {provision.section} ({provision.kind}), from {pack.origin[provision.id]}"
    if provision.url:
        yield provision.url
    yield from (f"- {said(effect)}" for effect in provision.effects)
    yield from _sources(provision.sources)
    yield from (f"also searched by ({language}): {words}" for language, words in provision.topics.items())


def _sign(pack: Pack, sign: Sign) -> Iterator[str]:
    yield f"{sign.code}: {sign.national} ({sign.shape}, {sign.group}), from {pack.origin[f'sign:{sign.code}']}"
    yield f"the driver must: {sign.action.replace('_', ' ')}"
    yield from (f"means ({language}): {text}" for language, text in sign.meaning.items())
    yield from (f"note ({language}): {text}" for language, text in sign.note.items())
    if sign.values:
        yield f"values: {', '.join(f'{value:g}' for value in sign.values)} {sign.unit or pack.manifest.units}"
    yield from (f"law: {name} ({pack.provisions[name].section})" for name in sign.provisions)
    yield from _sources(sign.sources)


def _sources(sources: tuple[Source, ...]) -> Iterator[str]:
    for source in sources:
        yield f"[{source.language}] {source.document}, characters {source.start} to {source.end}:"
        yield f"    {source.excerpt}"
