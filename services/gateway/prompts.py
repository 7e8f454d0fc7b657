"""Prompts: questions that a driver, a fleet or an author of law asks, with what the system knows embedded as data."""

from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import anyio.to_thread
from mcp import types
from mcp.server import ServerRequestContext
from mcp.shared.exceptions import MCPError
from msgspec import json

from domain.languages import LANGUAGES
from proto.tools import INVALID_PARAMS
from services.gateway.addresses import ADVICE, DECISION, HEALTH, REPORT, WORLD, citation_address, parsed
from services.gateway.resources import DATA, Resources

MOST_ARGUMENT = 300
MOST_CITED = 4
Arguments = Mapping[str, str]
_ANSWER = (
    "Answer in {language}, in at most five short sentences, in words that a driver uses. Say what is not known. Cite the law by "
    "section and address of the paragraph where one was cited."
)


class Prompt(NamedTuple):
    """One row: what a client shows, the arguments (name, what it is, whether it is needed), text and what is embedded."""

    title: str
    description: str
    arguments: tuple[tuple[str, str, bool], ...]
    text: str
    embedded: Callable[[Arguments], tuple[str, ...]]


_LANGUAGE = ("language", "two letters, for example de; en otherwise", False)
_OTHERWISE: Arguments = {"language": "en", "seconds": "10", "preset": '"abs_fault"'}
_TICK = ("tick", "number of the tick; the last message's otherwise", False)


def _decision(arguments: Arguments) -> tuple[str, ...]:
    return (DECISION.replace("{tick}", arguments["tick"]),) if arguments.get("tick") else ()


PROMPTS: Mapping[str, Prompt] = {
    "explain_last_advice": Prompt(
        "Explain the last advice",
        "What the driver was told last, why, and by what law.",
        (_LANGUAGE,),
        f"Explain to the driver the last message in the advice below: what it asked for, what was seen, and what the law says. {_ANSWER}",
        lambda _: (ADVICE,),
    ),
    "safe_to_drive_on": Prompt(
        "Is it safe to drive on?",
        "What the car's health, the weather and the road say of driving on.",
        (_LANGUAGE,),
        "Judge whether it is safe to drive on, from the vehicle's health and the world state below. What is missing, late or not "
        f"fresh is not known, and what is not known is no sign of safety. Never promise that it is safe. {_ANSWER}",
        lambda _: (HEALTH, WORLD),
    ),
    "why_slow_down": Prompt(
        "Why was I told to slow down?",
        "The numbers and the law behind a message to slow down.",
        (_TICK, _LANGUAGE),
        "Explain why the driver was told to slow down: what bounds the target speed, the limit in force, and the smallest change "
        f"that would have led to another decision. Without a decision below, ask `explain_decision` for the message's tick. {_ANSWER}",
        lambda arguments: (ADVICE, *_decision(arguments)),
    ),
    "audit_drive": Prompt(
        "Audit this drive",
        "What a drive's report shows of messages, late answers, changed settings and the log's chain.",
        (("drive", "name of the drive's folder, as in its report's address", True), _LANGUAGE),
        "Audit the drive whose report is linked below. Say first whether the log's chain verifies, then: each message and the law it "
        "cites, messages that were late or wrong, tools that were late or missing, settings that differ from their defaults, faults "
        "of the vehicle. Quote tick numbers. {language} is the language of the audit.",
        lambda arguments: (REPORT.replace("{id}", arguments["drive"]),),
    ),
    "diagnose_vehicle": Prompt(
        "Diagnose the vehicle",
        "What the car's units and signals say of its health: faults, evidence, what to do next.",
        (_LANGUAGE,),
        "Diagnose the vehicle, from its health below and by asking: `get_vehicle_snapshot` for values, `read_dtcs` and `uds_read_dtcs` "
        "for trouble codes with their status, `read_j1939_dtcs` where the car has such a bus, `explain_dtc` for each code. Clear "
        "nothing, reset nothing, give the car no fault. Say first whether the car needs attention or has to stop, then each fault with "
        "the value or code that shows it, its likely cause and the next step. A unit that did not answer and a value that is old are "
        f"not known, and what is not known is no sign of health. Never promise that driving is safe. {_ANSWER}",
        lambda _: (HEALTH,),
    ),
    "explain_code": Prompt(
        "Explain a trouble code",
        "What a code means, how urgent it is, and whether the fault is there now.",
        (("code", "a trouble code, for example C0035, or SPN and FMI of J1939", True), _LANGUAGE),
        "Explain the trouble code {code} (quoted, as it was typed). Ask `explain_dtc` for its meaning. Then say whether it is active "
        "on this vehicle: `uds_read_dtcs` of the unit and `read_dtcs`, of J1939 `read_j1939_dtcs`. `test_failed` is a fault that is "
        "there now, `confirmed` alone one that was; without an answer that is not known. Name the common causes, the likeliest "
        f"first, how urgent it is, and what to look at first. {_ANSWER}",
        lambda _: (),
    ),
    "summarise_last_seconds": Prompt(
        "Summarise the last seconds",
        "How the car was driven just now: speed, engine, pedals, what stood out.",
        (("seconds", "how far back, 1 to 600 s; 10 otherwise", False), _LANGUAGE),
        "Summarise how the vehicle was driven in the last {seconds} s. Ask `get_vehicle_snapshot` for the signals there are, then "
        "`monitor_signal` with that `duration_s` for speed, engine speed, brake and steering. Give least, mean and greatest of each "
        "with its unit, say whether the car sped up, held its speed or slowed down, and what is unusual. A window without samples "
        f"is not known, and no standstill. {_ANSWER}",
        lambda _: (WORLD,),
    ),
    "fault_drill": Prompt(
        "Fault drill on the simulated car",
        "Gives the simulated car a fault, diagnoses it from the evidence, and ends it.",
        (("preset", "fault scenario of the simulated car; abs_fault otherwise", False), _LANGUAGE),
        "Run a drill on the simulated car, and on no other: where `activate_fault_scenario` is refused, say so and stop. Call it with "
        "the preset {preset}. Then diagnose as if its name were not known, from `get_vehicle_snapshot`, `read_dtcs`, `uds_read_dtcs` "
        "and `vehicle_health` alone, and say what each showed. Compare that with the description that the first call gave. End every "
        f"fault by `activate_fault_scenario` without a preset, also where a step failed, and check that the codes are gone. {_ANSWER}",
        lambda _: (),
    ),
    "investigate_log": Prompt(
        "Investigate a recorded log",
        "What happened in a recorded CAN log, when, and why.",
        (("log", "a log as list_can_logs names it", True), _LANGUAGE),
        "Investigate the recorded CAN log {log} (quoted, as it was typed): `list_can_logs`, then `analyze_can_log` for its length, "
        "messages, codes, silences and what could not be read. For each signal with an unusual range ask `get_log_signal` and find "
        "when the change began. Give a short timeline with times in s, the likeliest cause, the evidence, and what the log does not "
        "show: signals that are held back, records that are malformed, an end that was left out. {language} is the language.",
        lambda _: (),
    ),
    "write_provision": Prompt(
        "Write a rulepack's provision",
        "A draft of a provision for a rulepack, in its form, to be checked by a lawyer.",
        (
            ("pack", "id of a loaded rulepack, for example DEU-v1", True),
            ("topic", "what the provision is about, in plain words", True),
            ("document", "a document of the pack as an example of its form, for example sources/signs.en.md", False),
        ),
        "Draft a provision for the rulepack {pack} on this topic (quoted, as its author wrote it): {topic}. Restate the law in your own "
        "words and name its official source; leave a place open rather than invent a section, a number or a date. Give the "
        "paragraph for `sources/*.md` and the entry for `provisions.json` with `draft` true: `drivemcp rulepack validate` checks "
        "them, and a lawyer decides. Ask `lookup_rule` first for what the pack says already.",
        lambda _: (),
    ),
}


class Prompts:
    """Serves the table; what it embeds comes from the resources."""

    def __init__(self, resources: Resources) -> None:
        self._resources = resources

    async def listed(
        self, _: ServerRequestContext[Any, Any], __: types.PaginatedRequestParams | None
    ) -> types.ListPromptsResult:
        """All of them."""
        found = [
            types.Prompt(
                name=name,
                title=row.title,
                description=row.description,
                arguments=[
                    types.PromptArgument(name=argument, description=what, required=needed)
                    for argument, what, needed in row.arguments
                ],
            )
            for name, row in PROMPTS.items()
        ]
        return types.ListPromptsResult(prompts=found, ttl_ms=60_000, cache_scope="private")

    async def get(
        self, _: ServerRequestContext[Any, Any], params: types.GetPromptRequestParams
    ) -> types.GetPromptResult:
        """One, with its arguments put in. Raises MCPError."""
        row = PROMPTS.get(params.name)
        if row is None:
            raise MCPError(INVALID_PARAMS, f"no prompt {params.name[:80]!r}: there are {', '.join(PROMPTS)}")
        arguments = _checked(row, params.arguments or {})
        messages = await anyio.to_thread.run_sync(self._messages, row, arguments)
        return types.GetPromptResult(description=row.description, messages=messages)

    def _messages(self, row: Prompt, arguments: Arguments) -> list[types.PromptMessage]:
        quoted = {
            name: value if name == "language" else json.encode(value).decode() for name, value in arguments.items()
        }
        text = row.text.format_map({**_OTHERWISE, **quoted})
        content: list[types.ContentBlock] = [types.TextContent(text=f"{text}\n\n{DATA}")]
        content += [self._embedded(uri) for uri in row.embedded(arguments)]
        if "document" in arguments:
            content.append(self._example(arguments["pack"], arguments["document"]))
        return [types.PromptMessage(role="user", content=each) for each in content]

    def _embedded(self, uri: str) -> types.ContentBlock:
        """The resource's content; of a page its address alone, and of what cannot be had the reason."""
        address = parsed(uri)
        if address is None:
            raise MCPError(INVALID_PARAMS, f"no resource {uri[:120]!r}")
        if address.form == "report":
            return types.ResourceLink(uri=uri, name=f"Report of drive {address.parts[0]}", mime_type="text/html")
        try:
            text = self._resources.text(address)
        except MCPError as error:
            text = json.encode({"note": DATA, "unknown": error.error.message}).decode()
        return types.EmbeddedResource(
            resource=types.TextResourceContents(uri=uri, mime_type="application/json", text=text)
        )

    def _example(self, pack: str, document: str) -> types.ContentBlock:
        found = self._resources.places(f"{pack}/{document}")
        if not found:
            raise MCPError(INVALID_PARAMS, f"no loaded rulepack has a document {f'{pack}/{document}'[:120]!r}")
        return self._embedded(citation_address(f"{pack}/{document}", found[0]))


def _checked(row: Prompt, given: Arguments) -> Arguments:
    known = {name for name, _, _ in row.arguments}
    missing = [name for name, _, needed in row.arguments if needed and not given.get(name)]
    unknown = sorted(set(given) - known)
    if missing or unknown:
        raise MCPError(
            INVALID_PARAMS, f"arguments of the prompt: {missing} are missing, {[name[:40] for name in unknown]} unknown"
        )
    if any(len(value) > MOST_ARGUMENT for value in given.values()):
        raise MCPError(INVALID_PARAMS, f"an argument has at most {MOST_ARGUMENT} characters")
    if given.get("language", "en") not in LANGUAGES:
        raise MCPError(INVALID_PARAMS, f"language is one of {', '.join(LANGUAGES)}")
    if given.get("tick") and not given["tick"].isdecimal():
        raise MCPError(INVALID_PARAMS, "tick is a number")
    if given.get("seconds") and not (given["seconds"].isdecimal() and 1 <= int(given["seconds"]) <= 600):
        raise MCPError(INVALID_PARAMS, "seconds is a number from 1 to 600")
    return {name: value for name, value in given.items() if value}
