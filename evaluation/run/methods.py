"""The methods that are compared and the ablations: settings of the same services, and nothing else.

Rows of a report are labelled with the backend that made them beside the method (`made_with`). With `embedded` the two Direct
methods are an extractive reader of their prompt, no language model (`EXTRACTIVE`).
"""

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import msgspec

from evaluation.baselines.direct.cassette import kind_of
from evaluation.run.spec import RunSpec
from evaluation.stand_ins.kinds import StandIn

DIRECT = (
    "The front end answers one fixed prompt (system line, context, query) per event; its text is parsed by the closed grammar "
    "of the front end, and only advises."
)
EXTRACTIVE = (
    " With the embedded backend an extractive reader picks one sentence of that prompt: it is no language model, and says "
    "nothing of what one would reach."
)
"""What has to be said beside the note of a Direct method that such a reader made."""
COMPLETED = (
    " The language model gets the text of the scene and no picture. Unless another file is set it is gemma3-270m: 270 million "
    "parameters, base weights of four bits."
)
"""The same where a language model of a GGUF file did."""
PROPOSED = (
    "Events and tools as in DriveMCP. A language model words and decides what they come to: it answers one prompt per event, with the "
    "scene and the tools' answers in it, in place of fusion."
)
DECODINGS = {
    "free": " Any text counts that the parser understands.",
    "forms": " Decoding is held to the sentences that the parser knows.",
}
PROMPT_TOOL = "answer_prompt"
PASSAGES = 3
"""Retrieved passages in the prompt of VLM-Direct+RAG."""
WITHOUT_EXPERTS = ("rules", "retrieval", "arbiter")
_ALONE = ("perception", "drivelm", "weather", "can", "logger")
_NO_RETRIEVAL = ("perception", "drivelm", "rules", "weather", "can", "arbiter", "logger")


class Method(msgspec.Struct, frozen=True, kw_only=True):
    """A row of a table: what is set otherwise than in the full system."""

    label: str
    settings: Mapping[str, Mapping[str, Any]] = {}
    """Service -> its settings."""
    without: tuple[str, ...] = ()
    stand_ins: tuple[StandIn, ...] = ()
    """What is published in place of what the services perceive (`evaluation/stand_ins`)."""
    note: str = ""
    """What has to be said of the row."""


def _by_label(*methods: Method) -> Mapping[str, Method]:
    return MappingProxyType({method.label: method for method in methods})


FULL = Method(label="DriveMCP", note="The full system: all services, the calibrated profile.")

METHODS = _by_label(
    Method(
        label="No-assistant",
        settings={"orchestrator": {"method": "silent"}},
        note="The floor: everything runs and is logged, the driver is told nothing and the car does not brake.",
    ),
    Method(
        label="VLM-Direct",
        settings={"orchestrator": {"method": "direct", "expected": _ALONE}, "drivelm": {"whole_prompts": True}},
        without=WITHOUT_EXPERTS,
        note=DIRECT,
    ),
    Method(
        label="VLM-Direct+RAG",
        settings={
            "orchestrator": {
                "method": "direct",
                "method_settings": {"passages": PASSAGES},
                "expected": (*_ALONE, "retrieval"),
            },
            "drivelm": {"whole_prompts": True},
        },
        without=("rules", "arbiter"),
        note=DIRECT + " The best passages of the rulepacks and sign tables are part of the prompt.",
    ),
    Method(
        label="VLM-Tools-NoArbiter",
        settings={"arbiter": {"filter": "none"}},
        note="Events, tools and fusion as in DriveMCP; the fused advice and the braking it suggests pass unjudged, within "
        "the bounds of the grant. Refused outside simulation.",
    ),
    FULL,
    Method(
        label="Oracle",
        stand_ins=("truth",),
        note="The ceiling: actors, limit in force, country, stops and lights come from truth in place of perception and "
        "front end; latency, law, weather and car as ever.",
    ),
)
"""The paper's four between floor and ceiling."""


def _worded(decoding: str) -> tuple[Method, ...]:
    """The rows of a language model, with one way of decoding."""
    drivelm: dict[str, Any] = {"whole_prompts": True, "prompt_backend": "gguf", "gguf": {"decoding": decoding}}
    direct, rag = METHODS["VLM-Direct"], METHODS["VLM-Direct+RAG"]
    proposer: dict[str, dict[str, Any]] = {"orchestrator": {"method": "proposer"}, "drivelm": drivelm}
    rows = (
        Method(
            label="LM-Direct",
            settings={**direct.settings, "drivelm": drivelm},
            without=direct.without,
            note=direct.note,
        ),
        Method(
            label="LM-Direct+RAG", settings={**rag.settings, "drivelm": drivelm}, without=rag.without, note=rag.note
        ),
        Method(
            label="LM-Tools-NoArbiter",
            settings={**proposer, "arbiter": {"filter": "none"}},
            note=PROPOSED + " What it says passes unjudged. Refused outside simulation.",
        ),
        Method(label="LM-Tools-Arbiter", settings=proposer, note=PROPOSED + " The arbiter stands behind it."),
    )
    return tuple(
        msgspec.structs.replace(row, label=f"{row.label}, {decoding}", note=row.note + DECODINGS[decoding])
        for row in rows
    )


PROPOSERS = _by_label(
    METHODS["No-assistant"],
    METHODS["VLM-Direct"],
    METHODS["VLM-Direct+RAG"],
    *(row for decoding in DECODINGS for row in _worded(decoding)),
    METHODS["VLM-Tools-NoArbiter"],
    FULL,
)
"""A language model in the rows that bear its name, beside the extractive reader, our fusion without the arbiter, and all of ours."""

OBEDIENT = Method(
    label="Obedient driver",
    settings={"simulator": {"driver": "obedient"}},
    note="Ours: the full system with a driver who follows every word, drives no faster than the limit believed in and never looks away: "
    "what infractions are left and were not told in time are the system's.",
)

ABLATIONS = _by_label(
    FULL,
    Method(
        label="No RAG in Rules",
        settings={"rules": {"law": False}, "orchestrator": {"expected": _NO_RETRIEVAL}},
        without=("retrieval",),
        note="No retrieval, no provisions, no sign table: a posted number counts as it stands, in the driver's home unit.",
    ),
    Method(
        label="No tool parallelism",
        settings={"orchestrator": {"parallel": False}},
        note="The tools of a tick are called one after another.",
    ),
    Method(
        label="No CAN context",
        stand_ins=("sound_car",),
        note="Speed and pedals are there; the car says nothing of its health and is taken for sound by all. (Left to itself "
        "the system would take an unknown car for a doubtful one, and be more careful.)",
    ),
    Method(
        label="No feedback adaptation",
        settings={"orchestrator": {"learns": False}},
        note="Labels are kept, and move nothing. Differs from DriveMCP only where labels are given.",
    ),
    Method(label="Oracle key facts", stand_ins=("truth",), note="The method Oracle."),
    Method(
        label="No silence",
        settings={"arbiter": {"filter": "talkative"}},
        note="Ours: the message of every tick is spoken; braking is judged as in DriveMCP.",
    ),
    Method(
        label="No grounding guard",
        settings={"drivelm": {"guard": False}},
        note="Ours: what the backend says counts however little picture, sign reader and map bear it out. With the embedded "
        "backend, which is its own sign reader, little is left to guard.",
    ),
    Method(
        label="No tracking",
        settings={"perception": {"tracking": False}},
        note="Ours: each picture's boxes are new actors, of unknown speed. Rendered sensors only: modelled ones have no boxes.",
    ),
    Method(
        label="Paper profile",
        settings={"arbiter": {"profile": "paper"}},
        note="Ours: the arbiter's constants as the paper prints them, under which ACT cannot be reached.",
    ),
)
"""The paper's ablations, then ours."""


def answers_prompts(spec: RunSpec) -> bool:
    """Whether the run's advice is answers to whole prompts, as that of the Direct methods and the proposer is."""
    return spec.settings.get("orchestrator", {}).get("method") in ("direct", "proposer")


def generator_of(spec: RunSpec) -> str:
    """The backend that answers whole prompts; `embedded`: the extractive reader."""
    return str(spec.settings.get("drivelm", {}).get("prompt_backend") or backend_of(spec))


def backend_of(spec: RunSpec) -> str:
    """The backend that looks at the run's pictures."""
    return str(spec.settings.get("drivelm", {}).get("backend") or "embedded")


def kind_of_answers(spec: RunSpec) -> str:
    """What the names of its answers to whole prompts begin with in a cassette."""
    drivelm = spec.settings.get("drivelm", {})
    return kind_of(generator_of(spec), drivelm.get("gguf", {}).get("decoding", "free"))


def made_with(spec: RunSpec) -> str:
    """The backend that makes the run's advice: of methods that answer prompts the one that does, a recorded one by model and digest."""
    if not answers_prompts(spec):
        return backend_of(spec)
    recorded = spec.settings.get("drivelm", {}).get("answers", {}).get("model", "")
    named = recorded.partition(" ")[0]
    return named if named and generator_of(spec) != "embedded" else generator_of(spec)


def noted(note: str, spec: RunSpec) -> str:
    """What has to be said of a row, as it was made."""
    said = {"embedded": EXTRACTIVE, "gguf": COMPLETED}.get(generator_of(spec), "")
    return note + (said if answers_prompts(spec) else "")


def by_language_model(spec: RunSpec, backend: str) -> RunSpec | None:
    """A row of the language model, by another backend; None: that backend cannot be held to a grammar. Other rows stay as they are."""
    drivelm = spec.settings.get("drivelm", {})
    if drivelm.get("prompt_backend") != "gguf" or backend == "gguf":
        return spec
    if drivelm["gguf"]["decoding"] != "free":
        return None
    others = {key: value for key, value in drivelm.items() if key != "gguf"}
    return msgspec.structs.replace(spec, settings={**spec.settings, "drivelm": {**others, "prompt_backend": backend}})


def applied(method: Method, spec: RunSpec) -> RunSpec:
    """The run by this method. Settings of the run stay but where the method says otherwise."""
    settings = {name: dict(fields) for name, fields in spec.settings.items()}
    for name, fields in method.settings.items():
        settings[name] = {**settings.get(name, {}), **fields}
    return msgspec.structs.replace(
        spec,
        method=method.label,
        settings=settings,
        without=tuple(dict.fromkeys((*spec.without, *method.without))),
        stand_ins=tuple(dict.fromkeys((*spec.stand_ins, *method.stand_ins))),
    )
