"""The Rules service: binds the rule book to tools and asks retrieval for evidence; decides nothing."""

from datetime import UTC, datetime
from typing import Annotated

import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.errors import ConfigError, ToolFailed
from drivemcp.files.packfiles import folder_of
from drivemcp.node import Node
from drivemcp.registry import registered
from drivemcp.runtime.grants import public_key
from drivemcp.service import Service
from proto.health import ServiceLog
from proto.rules import (
    CitablePlaces,
    CitedParagraph,
    Retrieved,
    RightOfWayQuestion,
    RulepackInfo,
    RulesAnswer,
    SignMeaning,
    Situation,
    VehicleClass,
)  # fmt: skip
from proto.scene import Candidate, Unit
from proto.topics import LOG
from services.rules import citing
from services.rules.book import is_fallback, normal_jurisdiction
from services.rules.limits import limit_answer
from services.rules.lookup import evidence, rule_lookup
from services.rules.packs.pins import unlike_shipped
from services.rules.packs.signature import Trust
from services.rules.right_of_way import right_of_way as stop_or_proceed
from services.rules.shelf import Edition, Shelf
from services.rules.signs import meaning
from services.rules.situations import coarse

WITHOUT_LAW = "drivemcp.without_law"
"""Group of entry points: a function that offers the tools of the Rules on a node without any law."""
RETRIEVAL_DEADLINE_MS = 22.0
"""Of a tool's 40 ms: what is left must suffice for the answer and two ways over the bus."""
WARM_UP_DEADLINE_MS = 500.0
WARM_UP_PERIOD_S = 1.0
MAX_QUERY = 500
MAX_PLACES = 1000

Reading = Annotated[str, msgspec.Meta(max_length=64, description="sign code as read", examples=["limit:80"])]
Jurisdiction = Annotated[
    str | None, msgspec.Meta(description="country, ISO 3166 alpha-3, or a part of one", examples=["GBR-WLS"])
]
Language = Annotated[
    str, msgspec.Meta(max_length=16, description="of the answer: en, de, fr, nl, pl, it or es", examples=["de"])
]
Plates = Annotated[tuple[str, ...], msgspec.Meta(description="plates below it, as read", examples=[["22-06 h"]])]
Candidates = Annotated[tuple[Candidate, ...], msgspec.Meta(description="other readings, where it is in doubt")]
HomeUnit = Annotated[Unit, msgspec.Meta(description="the driver's unit")]
Class = Annotated[VehicleClass | None, msgspec.Meta(description="class of the vehicle")]
Query = Annotated[
    str,
    msgspec.Meta(
        max_length=MAX_QUERY, description="the question in plain words", examples=["How fast may I drive in fog?"]
    ),
]
RoadWords = Annotated[str, msgspec.Meta(description="words on the road here", examples=["motorway, wet"])]
Count = Annotated[int, msgspec.Meta(ge=1, le=10, description="number of passages cited at most", examples=[3])]

Document = Annotated[
    str, msgspec.Meta(max_length=200, description="as citations name it, for example DEU-v1/sources/signs.en.md")
]
Offset = Annotated[int, msgspec.Meta(ge=0, le=10_000_000, description="characters from the document's beginning")]


class RulesConfig(ServiceConfig, frozen=True, kw_only=True):
    """Which rulepacks are loaded, and what the vehicle's configuration expects of them."""

    packs: tuple[str, ...] = (
        "DEU-v1", "DEU-v1-VSL", "GBR-v1", "FRA-v1", "AUT-v1", "NLD-v1", "POL-v1", "CHE-v1", "BEL-v1",
        "IRL-v1", "ITA-v1", "ESP-v1", "USA-v1", "USA-CA-v1", "USA-NY-v1", "USA-TX-v1", "USA-FL-v1", "USA-WA-v1", "VIENNA-v1",
    )  # fmt: skip
    """Names below `rulepacks/`, or paths of folders."""
    require_signature: bool = False
    """Whether a pack, and every pack it extends, must be signed by one of `pack_keys`; implied by them."""
    pack_keys: tuple[str, ...] = ()
    """Public keys (base64). Where one is named, a pack without a signature of one of them is refused."""
    """Public keys (base64) whose signatures on rulepacks count."""
    reload_s: float = 1.0
    """How often the packs' files are looked at; 0: never. In lockstep they are not."""
    expected_packs: dict[str, str] = msgspec.field(default_factory=dict)
    """Version by pack id that this vehicle was configured for; an older pack lowers confidence."""
    today: str = ""
    """ISO date against which effective dates are checked; empty: that of the start, in lockstep none."""
    passages: int = 4
    """Passages that Retrieval is asked for."""
    cache_size: int = 512
    """How many answers, by route segment and situation, and how many retrieved passages are kept."""
    languages: tuple[str, ...] = ("en", "de")
    """In which retrieval is asked once at the start, so that the first answers are quick."""
    law: bool = True
    """Off, in simulation alone: an evaluation's own answers, found by entry point, and no law."""


class _Evidence:
    """Retrieval over the bus, each question asked once."""

    def __init__(self, node: Node, config: RulesConfig) -> None:
        self._node = node
        self._passages = config.passages
        self._languages = config.languages
        self._looked = False

    @property
    def alive(self) -> bool:
        """Whether retrieval is there to be asked; a call to a service that is not there would be waited for.

        In lockstep it is looked for once and waited for, so that two runs find the same.
        """
        if self._node.lockstep:
            if not self._looked:
                self._looked = True
                self._node.client.discover()
            return "retrieve" in self._node.catalogue()
        return "retrieve" in self._node.catalogue() and "retrieval" in self._node.alive_services()

    def ask_usual(self, edition: Edition, query: str, jurisdiction: str | None, language: str) -> Retrieved | None:
        """One of the questions that `_warm_up` asks when the service starts. In lockstep, where nothing runs beside the
        steps, it is asked when it is first needed, with the time that it would have had then.
        """
        was_asked = self._node.lockstep and language in self._languages
        deadline_ms = WARM_UP_DEADLINE_MS if was_asked else RETRIEVAL_DEADLINE_MS
        return self.ask(edition, query, jurisdiction, language, deadline_ms=deadline_ms)

    def ask(
        self,
        edition: Edition,
        query: str,
        jurisdiction: str | None,
        language: str,
        context: str = "",
        deadline_ms: float = RETRIEVAL_DEADLINE_MS,
        corpus: str = "all",
    ) -> Retrieved | None:
        """What retrieval finds; None where it is not there or too slow."""
        arguments = {
            "query": query,
            "jurisdiction": jurisdiction,
            "language": language,
            "corpus": corpus,
            "k": self._passages,
        }
        if context:
            arguments["road_context"] = context
        key = (query, jurisdiction, language, context, corpus)
        if (known := edition.retrieved.get(key)) is not None:
            return known
        if not self.alive:
            return None
        outcome = self._node.call("retrieve", arguments, deadline_ms=deadline_ms)
        if not outcome.ok:
            return None
        try:
            found = msgspec.convert(outcome.result, Retrieved)
        except msgspec.ValidationError as error:
            self._node.log.warning("retrieval answers what is no passage list: %s", error)
            return None
        if _lasting(edition, found):
            edition.retrieved.put(key, found)
        return found


def _lasting(edition: Edition, found: Retrieved) -> bool:
    """Whether the same question would be answered the same later.

    Not while the encoder is loading or was late, nor while retrieval still has, or already has, another version of a pack.
    """
    same = all(evidence.current(passage, edition.versions) for passage in found.passages)
    return same and not found.encoder.endswith(("(loading)", "late)"))


def _offer_without_law(node: Node) -> None:
    """The same tools from an evaluation. Raises ConfigError outside of simulation, and where no evaluation is installed."""
    if not node.lockstep:
        raise ConfigError(
            "rules.law = false reads limits in the wrong unit abroad; it is for simulation: it needs lockstep"
        )
    registered(WITHOUT_LAW, "numbers_alone", "rules.law")(node)


def build(config: RulesConfig, node: Node) -> None:
    """Load the packs, offer the tools, follow the packs on disk."""
    if not config.law:
        _offer_without_law(node)
        return
    shelf = Shelf(
        tuple(folder_of(name) for name in config.packs),
        expected=config.expected_packs,
        today=_today(config, node),
        trust=_trust(config),
        cache_size=config.cache_size,
    )
    for reason in shelf.refused:
        node.log.error("rulepack refused: %s", reason)
    _describe(node, shelf)
    node.watch_services()
    found = _Evidence(node, config)
    _offer_limits(node, shelf, found)
    _offer_signs(node, shelf)
    _offer_lookup(node, shelf, found)
    _offer_citations(node, shelf)
    if not node.lockstep:
        node.every(WARM_UP_PERIOD_S, lambda: _warm_up(shelf.edition, found, config.languages))
        if config.reload_s > 0:
            node.every(config.reload_s, lambda: _follow(node, shelf))


def _today(config: RulesConfig, node: Node) -> str:
    if config.today or node.lockstep:
        return config.today
    return datetime.fromtimestamp(node.clock.now_ns() / 1e9, UTC).date().isoformat()


def _trust(config: RulesConfig) -> Trust:
    if config.require_signature and not config.pack_keys:
        raise ConfigError("require_signature: without pack_keys (public keys, base64) no rulepack could be trusted")
    return Trust(
        keys=tuple(public_key(key) for key in config.pack_keys),
        required=config.require_signature or bool(config.pack_keys),
    )


def _follow(node: Node, shelf: Shelf) -> None:
    """Take changed packs into use and say so: in the log, on the bus, in the health."""
    change = shelf.look()
    if change is None:
        return
    _describe(node, shelf)  # before it is told: a service that hears of it finds it in the health
    for reason in change.refused:
        node.log.error("changed rulepack refused, what was loaded before stays: %s", reason)
        node.publish(
            LOG, ServiceLog(service=node.name, level="error", message="rulepack refused", fields={"why": reason})
        )
    for old, new in change.versions:
        node.log.info("rulepack_version %s, before: %s", new, old or "none")
        fields = {"rulepack_version": new, "before": old}
        node.publish(LOG, ServiceLog(service=node.name, level="info", message="rulepack changed", fields=fields))


def _describe(node: Node, shelf: Shelf) -> None:
    node.detail["rulepacks"] = " ".join(pack.version for pack in shelf.edition.book.packs.values()) or "none"
    unlike = unlike_shipped(manifest for pack in shelf.edition.book.packs.values() for manifest in pack.line)
    for line in unlike:
        if line not in node.detail.get("not_as_shipped", ""):
            node.log.warning("rulepack %s", line)
            node.publish(
                LOG,
                ServiceLog(service=node.name, level="warning", message="rulepack not as shipped", fields={"why": line}),
            )
    for name, lines in (("refused", shelf.refused), ("not_as_shipped", unlike)):
        if lines:
            node.detail[name] = "; ".join(lines)
        else:
            node.detail.pop(name, None)


def _warm_up(edition: Edition, found: _Evidence, languages: tuple[str, ...]) -> None:
    places = [pack.manifest.jurisdiction for pack in edition.book.packs.values() if not is_fallback(pack)]
    for country in dict.fromkeys((*places, None)):
        for language in languages:
            for query in evidence.questions(language):
                if found.ask(edition, query, country, language, deadline_ms=WARM_UP_DEADLINE_MS) is None:
                    return


def _now(shelf: Shelf) -> Edition:
    """The edition that one answer is made from, from its beginning to its end."""
    edition = shelf.edition
    if not edition.book.packs:
        raise ToolFailed("no rulepack could be loaded", do="look into the log of the rules service, which says why")
    return edition


def _offer_limits(node: Node, shelf: Shelf, found: _Evidence) -> None:
    @node.tool(deadline_ms=40)
    def applicable_limit(situation: Situation) -> RulesAnswer:
        """The speed limit in force here: posted, gantry, zone and conditional limits and the law's own, the most careful in doubt.

        An unknown fact never raises the limit. `limit.advisory` marks a recommended speed where no limit exists.
        """
        edition = _now(shelf)
        asked, alive = coarse(situation), found.alive
        known = edition.answers.get(asked, lambda answer: not alive or "retrieval" not in answer.degraded)
        if known is not None:
            node.detail["answers"] = edition.answers.said()
            return known if alive else evidence.from_memory(known)
        answer = limit_answer.applicable_limit(edition.book, asked)
        query = evidence.question_for(answer, asked.language)
        retrieved = found.ask_usual(edition, query, _country(edition, asked.jurisdiction), asked.language)
        answer = evidence.supported(answer, retrieved, asked, edition.versions)
        if not alive if retrieved is None else _lasting(edition, retrieved):
            edition.answers.put(asked, answer)
        node.detail["answers"] = edition.answers.said()
        return answer if found.alive else evidence.from_memory(answer)


def _offer_signs(node: Node, shelf: Shelf) -> None:
    @node.tool(deadline_ms=40)
    def interpret_sign(
        reading: Reading,
        jurisdiction: Jurisdiction = None,
        language: Language = "en",
        plates: Plates = (),
        candidates: Candidates = (),
        home_unit: HomeUnit = "km/h",
        vehicle_class: Class = None,
    ) -> SignMeaning:
        """What a sign means in this country, in the driver's language, with its national number and the law behind it.

        With several candidate readings the most careful one is answered and the others are named. A sign that binds some classes of
        vehicle alone (`binds`) is answered for `vehicle_class`; where that is not given the sign is taken to bind, and the note says so.
        """
        book = _now(shelf).book
        question = meaning.SignQuestion(
            reading=reading,
            jurisdiction=jurisdiction,
            language=language,
            plates=plates,
            candidates=candidates,
            home_unit=home_unit,
            vehicle_class=vehicle_class,
        )
        return meaning.interpret_sign(book, question)

    @node.tool(deadline_ms=40)
    def right_of_way(question: RightOfWayQuestion) -> RulesAnswer:
        """Stop, give way or proceed at a junction: light before sign before general rule; who is unknown is taken to be there."""
        return stop_or_proceed(_now(shelf).book, question)


def _offer_lookup(node: Node, shelf: Shelf, found: _Evidence) -> None:
    @node.tool(deadline_ms=60)
    def lookup_rule(
        query: Query,
        jurisdiction: Jurisdiction = None,
        language: Language = "en",
        road_context: RoadWords = "",
        k: Count = 3,
    ) -> RulesAnswer:
        """What the law says on a question in plain words: the best passages, cited with document and offsets."""
        edition = _now(shelf)
        retrieved = found.ask(
            edition,
            query,
            _country(edition, jurisdiction),
            language,
            road_context[:MAX_QUERY],
            45.0,
            rule_lookup.corpus_for(query),
        )
        return rule_lookup.lookup_rule(edition.book, query, jurisdiction, language, retrieved, k)

    @node.tool(deadline_ms=20)
    def list_rulepacks() -> tuple[RulepackInfo, ...]:
        """The rulepacks that are loaded: version, content hash, units, side of traffic, dates."""
        return shelf.edition.book.infos()


def _offer_citations(node: Node, shelf: Shelf) -> None:
    @node.tool(deadline_ms=40)
    def cited_paragraph(document: Document, offset: Offset) -> CitedParagraph:
        """The text that a citation points at: the provision or sign of a loaded rulepack that holds this character."""
        found = citing.paragraph_at(shelf.edition.book.packs, document, offset)
        if found is None:
            raise ToolFailed(f"no loaded rulepack has a text at character {offset} of {document!r}")
        return found

    @node.tool(deadline_ms=40)
    def citable_places(document: Document = "") -> CitablePlaces:
        """What can be cited: rulepacks without a document, the documents of `PACK`, the offsets in `PACK/sources/x.md`."""
        return CitablePlaces(places=citing.places(shelf.edition.book.packs, document)[:MAX_PLACES])


def _country(edition: Edition, jurisdiction: str | None) -> str | None:
    """Whose passages are asked for: all countries' where this one is unknown or has no pack."""
    normal = normal_jurisdiction(jurisdiction)
    return normal if normal and edition.book.for_jurisdiction(normal) else None


SERVICE = Service("rules", RulesConfig, build)
