"""Topics, services, events, kinds of message, constants of the arbiter, metrics."""

import math

import msgspec

from evaluation.metrics.metrics import RATES, Metrics
from proto.messages import KINDS
from proto.services import RESERVED, SERVICES
from proto.topics import TOPICS
from scripts.reference.markdown import code, field_docs, page, table
from services.arbiter.profiles.profile import FOLDER, names, read_file
from services.orchestrator.events import MOVED, TABLE


def topics() -> str:
    """The topic table."""
    rows = [
        (
            f"`{row.name}`", f"`{row.message.__name__}`", f"{row.rate_hz:g}" if row.rate_hz else "on change",
            f"{row.max_age_ms:g}" if row.rate_hz else "", code(row.publishers), "all" if row.readers == ("*",) else code(row.readers),
            row.logged, row.encoding, row.keep, "yes" if row.droppable else "", "yes" if row.private else "",
        )
        for row in TOPICS
    ]  # fmt: skip
    head = (
        "topic", "message", "rate, Hz", "maximum age, ms", "published by", "read by", "logged", "encoding",
        "a slow reader gets", "droppable", "private",
    )  # fmt: skip
    return page(
        "Topics",
        "Each topic of the bus (`proto/topics.py`). Its key is `VEHICLE/TOPIC`. `proto/schemas` holds the JSON Schema of each message. "
        "A droppable message is lost rather than waited for on a congested link. Private topics never go to a guest or the gateway.",
        table(head, rows),
    )


def services() -> str:
    """The service table."""
    rows = [
        (
            f"`{row.name}`", f"`{row.extra}`", code(row.tools), "any" if row.calls == ("*",) else code(row.calls),
            str(row.start_order), str(row.step_order), str(row.memory_mb),
        )
        for row in SERVICES
    ]  # fmt: skip
    reserved = table(("tool", "may be called by"), [(f"`{tool}`", code(callers)) for tool, callers in RESERVED.items()])
    return page(
        "Services",
        "Each process (`proto/services.py`). `drivemcp run NAME` starts one; `pip install 'drivemcp[EXTRA]'` installs what it needs.",
        table(("service", "extra", "tools", "calls tools of", "start order", "step order", "memory limit, MB"), rows),
        "## Reserved tools\n\nOnly these services may call them.\n\n" + reserved,
    )


def events() -> str:
    """The event table."""
    low, high = MOVED
    return page(
        "Events",
        "An event holds while its measure g exceeds the threshold η (`services/orchestrator/events.py`). The events of a tick "
        "select the tools that it asks. `--set orchestrator.thresholds.EVENT=VALUE` sets another threshold, "
        f"between {low:g} and {high:g} times the one of the table.",
        table(
            ("event", "g", "η", "asks"),
            [(f"`{row.kind}`", row.g, f"{row.eta:g}", code(row.tools)) for row in TABLE],
        ),
    )


def kinds() -> str:
    """The kinds of message."""
    rows = [
        (
            f"`{row.kind}`", row.says,
            row.repeats or ("never in the same drive" if math.isinf(row.repeat_s) else f"after {row.repeat_s:g} s"),
            "yes" if row.first_notice else "", "yes" if row.presses else "", code(row.hazards),
        )
        for row in KINDS
    ]  # fmt: skip
    return page(
        "Kinds of message",
        "What a driver may be told (`proto/messages.py`), in order of weight: if several candidates are due, the first kind is said. "
        "A first notice that is owed is neither muted nor held back by the budget. Advice that never waits would be useless later.",
        table(("kind", "what", "repeated", "first notice is owed", "never waits", "hazards that it warns of"), rows),
    )


def constants() -> str:
    """The constants of the arbiter's profiles."""
    files = {name: read_file((FOLDER / f"{name}.toml").read_bytes(), name) for name in names()}
    rows = [
        (f"`{key}`", row.symbol, *(f"{file.constants[key].value:g}" for file in files.values()), row.unit, row.source, row.reason)
        for key, row in files["calibrated"].constants.items()
    ]  # fmt: skip
    return page(
        "Constants of the arbiter",
        "The value in each profile (`services/arbiter/profiles`); source and reason are those of the default profile, `calibrated`. "
        "[Safety mathematics](../explanation/safety.md) explains the symbols.",
        table(("constant", "symbol", *files, "unit", "source", "reason"), rows),
    )


def metrics() -> str:
    """The metrics of a run."""
    docs, rates = field_docs(Metrics), {row.count: (name, row) for name, row in RATES.items()}
    rows = [
        (f"`{each.name}`", docs[each.name], f"`{rates[each.name][0]}`, {rates[each.name][1].unit}" if each.name in rates else "")
        for each in msgspec.structs.fields(Metrics)
    ]  # fmt: skip
    return page(
        "Metrics",
        "The numbers of one run (`evaluation/metrics`), with their unit and source. An empty value was not measured. "
        "[How metrics are measured](../explanation/metrics.md) defines the terms.",
        table(("metric", "what it is", "as a rate"), rows),
    )
