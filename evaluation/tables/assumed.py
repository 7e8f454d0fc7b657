"""Rows whose advisory latency was not measured: calls of a tool without a measured latency take the fixed one."""

from collections.abc import Iterable

from evaluation.run.methods import PROMPT_TOOL, answers_prompts, generator_of
from evaluation.run.spec import RunSpec
from evaluation.tables.columns import LATENCY, Column
from evaluation.tables.tables import Table
from services.orchestrator.events import TOOLS


def assumed(column: Column, spec: RunSpec) -> bool:
    """Whether a row's number in this column is a latency made of nothing but assumed ones.

    A model that answers whole prompts takes its own time, which is measured as it answers.
    """
    if column.field != LATENCY.field or (answers_prompts(spec) and generator_of(spec) != "embedded"):
        return False
    return not spec.modelled_ms.keys() & waits_for(spec)


def waits_for(spec: RunSpec) -> frozenset[str]:
    """Tools that a row's advice may wait for; the Direct methods' waits for all of them each time."""
    if answers_prompts(spec):
        return frozenset(
            {
                PROMPT_TOOL,
                *(("retrieve",) if spec.settings["orchestrator"].get("method_settings", {}).get("passages") else ()),
            }
        )
    return frozenset(tool for tools in TOOLS.values() for tool in tools)


def about_latencies(tables: Iterable[Table], mark: str, measured: str = "") -> str:
    """What page and report say of these tables' latencies: where they begin (where that is `measured`), and what the mark means."""
    begin = f"Latencies go from the snapshot on: that a picture takes time to be understood is in no run{measured}."
    if not any(assumed(LATENCY, row.row.spec) for table in tables for row in table.rows):
        return begin
    return f"{begin} Those marked {mark} are 4 ms a call of tools that were asked too seldom to be measured."
