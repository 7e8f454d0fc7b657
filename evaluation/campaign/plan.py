"""The tables as data: rows, the runs behind each, and which columns stand beside the paper's."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from itertools import count
from pathlib import Path
from types import MappingProxyType
from typing import Any

import msgspec

from drivemcp.config import settings_of
from evaluation.campaign.names import TableName
from evaluation.corruption.spec import CLEAN, PAPER
from evaluation.run.latencies import Latencies, read
from evaluation.run.methods import ABLATIONS, METHODS, OBEDIENT, PROPOSERS, applied
from evaluation.run.spec import RunSpec, Sensors
from evaluation.scenarios import Family, generate

FAMILIES: Mapping[Family, str] = MappingProxyType(
    {"urb-rain": "URB-RAIN-MULTILINGUAL", "cross-border": "CROSS-BORDER", "dynamic-vsl": "DYNAMIC-VSL"}
)
"""The scenario families, and what the paper calls them."""
BORDER: Family = "cross-border"
OURS = "DriveMCP"
DELTAS = (0.0, 0.1, 0.2, 0.3, 0.4, 0.6, 0.8)
"""The paper's, and beyond."""
RATES = (0.0, 0.1, 0.2, 0.3, 0.4, 0.5)
CURVES: Mapping[str, str] = MappingProxyType(
    {"sign_miss": "signs missed", "limit_misread": "limits misread", "dropout": "actors dropped out"}
)
FIXED = "fixed"
"""In place of a table of latencies: 4 ms each."""
FAULTS = ("abs_fault@2", "low_tyre@2")
"""The paper's two, early on: the tyre is down to 1.3 bar about ten seconds later."""
FAULTY, SOUND = "faulty", "sound"
TEST_SEED = 1001


class Row(msgspec.Struct, frozen=True, kw_only=True):
    """One row of a table: what is driven, and which of the paper's rows it stands beside."""

    table: TableName
    key: str
    label: str
    family: Family
    spec: RunSpec
    """Without scenario and seed, which each run adds."""
    paper: str = ""
    """Its row in the paper's table; empty: the paper has none."""
    group: str = ""
    """Rows of one group stand together: a family, a curve, a pair."""
    at: float | None = None
    """Where on the curve."""
    note: str = ""
    adapts: bool = False
    """Each of its runs begins as labels on the runs before it have left the arbiter (`labelled.py`)."""


class Run(msgspec.Struct, frozen=True, kw_only=True):
    """One run of a row; the same number is the same place, driver and traffic in every row."""

    row: Row
    number: int
    spec: RunSpec


class Amount(msgspec.Struct, frozen=True, kw_only=True):
    """How much is driven for each row."""

    runs: int | None = None
    """So many; unset: 4, or as many as `km` takes."""
    km: float | None = None
    """At least so far, by the length of the routes."""
    runs_of: Mapping[TableName, int] = {}
    """More runs for the rows of single tables."""
    km_of: Mapping[str, float] = {}
    """More kilometres for single methods of the results table."""
    seconds: float = 0.0
    """Of each run; 0: to the end of its route."""
    first: int = 0
    """The number of the first place of each family."""


DEFAULT_RUNS = 4


def rows_of(table: TableName, sensors: Sensors) -> tuple[Row, ...]:
    """The rows of a table."""
    return tuple(_ROWS[table](RunSpec(scenario="", sensors=sensors)))


def _results(base: RunSpec) -> Iterable[Row]:
    for family, name in FAMILIES.items():
        for method in (*METHODS.values(), OBEDIENT):
            key = method.label
            yield Row(
                table="results", key=f"{family}/{key}", label=method.label, family=family, group=name,
                spec=applied(method, base), paper=f"{name}/{key}", note=method.note,
            )  # fmt: skip


def _proposer(base: RunSpec) -> Iterable[Row]:
    for family, name in FAMILIES.items():
        for key, method in PROPOSERS.items():
            yield Row(
                table="proposer", key=f"{family}/{key}", label=key, family=family, group=name, spec=applied(method, base),
                paper=f"{name}/{key.partition(',')[0].replace('LM-', 'VLM-') if key.startswith('LM-') else key}", note=method.note,
            )  # fmt: skip


def _corruption(base: RunSpec) -> Iterable[Row]:
    ours, family = applied(METHODS[OURS], base), BORDER
    for name, spec in PAPER.items():
        yield Row(
            table="corruption", key=name, label=_LABELS[name], family=family, paper=name,
            spec=msgspec.structs.replace(ours, corruption=spec.text()), group="The paper's rates",
        )  # fmt: skip
    for kind, label in CURVES.items():
        for rate in RATES:
            yield Row(
                table="corruption", key=f"{kind}={rate:g}", label=f"{label}, {rate * 100:g} %", family=family, group=label, at=rate,
                spec=msgspec.structs.replace(ours, corruption=f"{kind}={rate:g}" if rate else CLEAN),
            )  # fmt: skip


_LABELS = {
    CLEAN: "Clean sensor stack",
    "sign_miss_10": "Sign miss (10 %)",
    "sign_miss_30": "Sign miss (30 %)",
    "limit_misread_10": "Limit misread (10 %)",
    "actor_dropout_10": "Actor dropout (10 %)",
    "actor_dropout_30": "Actor dropout (30 %)",
}


def _delta(base: RunSpec) -> Iterable[Row]:
    ours = applied(METHODS[OURS], base)
    for delta in DELTAS:
        yield Row(
            table="delta", key=f"{delta:g}", label=f"{delta:g}", family="dynamic-vsl", at=delta, paper=f"{delta:g}",
            spec=with_settings(ours, "arbiter", {"delta": delta}), group="Delta",
        )  # fmt: skip


def _ablation(base: RunSpec) -> Iterable[Row]:
    for key, method in ABLATIONS.items():
        if base.sensors == "rendered" or key not in RENDERED_ONLY:
            yield Row(
                table="ablation", key=key, label=method.label, family="cross-border", spec=applied(method, base),
                paper=_ABLATED.get(key, ""), group="Ablations", note=method.note,
            )  # fmt: skip
    yield Row(
        table="ablation", key=ADAPTING, label=ADAPTING, family="cross-border", spec=applied(METHODS[OURS], base),
        group="Ablations", adapts=True,
        note="Ours: the runs as a sequence of drives. After each, a driver who knows the truth labels it; the next begins with the "
        "Delta and c_min that this leaves. The first run is DriveMCP's own; in all other rows nothing is labelled.",
    )  # fmt: skip


ADAPTING = "Feedback over the runs"
RENDERED_ONLY = ("No tracking", "No grounding guard")
"""Modelled sensors have neither boxes to track nor readings to guard."""
_ABLATED = {
    OURS: "full",
    "No RAG in Rules": "no_rag_in_rules",
    "No tool parallelism": "no_tool_parallelism",
    "No CAN context": "no_can_context",
    "No feedback adaptation": "no_feedback_adaptation",
    "Oracle key facts": "oracle_key_facts",
}
"""What the paper's numbers call them."""


def _can_fault(base: RunSpec) -> Iterable[Row]:
    for state, group in _STATES.items():
        for key, method in METHODS.items():
            sound = applied(method, base)
            yield Row(
                table="can-fault", key=f"{key}/{state}", label=method.label, family="dynamic-vsl", group=group, note=method.note,
                spec=with_settings(sound, "simulator", {"faults": list(FAULTS)}) if state == FAULTY else sound,
                paper=key if state == FAULTY else "",
            )  # fmt: skip


_STATES = {FAULTY: "ABS fault and low tyre", SOUND: "the same drives, car sound"}
_ROWS: Mapping[TableName, Callable[[RunSpec], Iterable[Row]]] = MappingProxyType(
    {
        "results": _results,
        "corruption": _corruption,
        "delta": _delta,
        "ablation": _ablation,
        "can-fault": _can_fault,
        "proposer": _proposer,
    }
)


def with_settings(spec: RunSpec, service: str, settings: dict[str, Any]) -> RunSpec:
    """The spec with more settings for one service; of a group of settings those that are not named stay."""
    merged = _merged(spec.settings.get(service, {}), settings)
    return msgspec.structs.replace(spec, settings={**spec.settings, service: merged})


def _merged(before: Mapping[str, Any], more: Mapping[str, Any]) -> dict[str, Any]:
    both = {key for key, value in more.items() if isinstance(value, dict) and isinstance(before.get(key), dict)}
    return {**before, **more, **{key: _merged(before[key], more[key]) for key in both}}


def latencies_of(file: str) -> Latencies | None:
    """The measured table; None: `FIXED`. Raises UserError naming the file."""
    return None if file == FIXED else read(Path(file))


def as_asked(spec: RunSpec, latencies: Latencies | None, settings: Sequence[str]) -> RunSpec:
    """The spec with the latencies and the settings (SERVICE.KEY=VALUE) that are the user's. Raises UserError naming the setting."""
    spec = msgspec.structs.replace(spec, modelled_ms={} if latencies is None else latencies.modelled_ms())
    for service, asked in settings_of(settings).items():
        spec = with_settings(spec, service, asked)
    return spec


def runs_of(rows: Iterable[Row], amount: Amount) -> tuple[Run, ...]:
    """All runs, all rows' first run before any row's second: a table that is cut short has its rows filled alike."""
    runs = [
        Run(row=row, number=number, spec=placed(row, number, amount.seconds))
        for row in rows
        for number in range(amount.first, amount.first + _needed(row, amount))
    ]
    return tuple(sorted(runs, key=lambda run: run.number))


def placed(row: Row, number: int, seconds: float) -> RunSpec:
    """A row's spec on the numbered place of the test split. Its own corruption is drawn on each."""
    spec = msgspec.structs.replace(
        row.spec, scenario=f"{row.family}/test/{number}", seed=TEST_SEED + number, seconds=seconds
    )
    if spec.corruption == CLEAN:
        return spec
    return msgspec.structs.replace(spec, corruption=f"{spec.corruption},seed={number + 1}")


def _needed(row: Row, amount: Amount) -> int:
    more_km = amount.km_of.get(row.spec.method) if row.table == "results" else None
    return max(
        _all_need(row.family, amount),
        amount.runs_of.get(row.table, 0),
        _for_km(row.family, more_km, amount.first) if more_km is not None else 0,
    )


def _all_need(family: Family, amount: Amount) -> int:
    if amount.km is None:
        return amount.runs or DEFAULT_RUNS
    return max(amount.runs or 1, _for_km(family, amount.km, amount.first))


def _for_km(family: Family, km: float, first: int) -> int:
    driven_m = 0.0
    for number in count():
        if driven_m >= km * 1000:
            return number
        driven_m += route_m(family, first + number)
    raise AssertionError


def route_m(family: Family, number: int) -> float:
    """How long a route of the test split is, from where the ego starts."""
    scenario = generate(family, number, "test")
    return sum(bend.length_m for bend in scenario.road.bends) - scenario.ego.at_m
