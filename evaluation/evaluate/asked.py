"""What the command line asks for: which rows, how much of each, and what is refused before anything is driven."""

import argparse
import shlex
from collections.abc import Callable, Collection, Iterator, Mapping, Sequence, Set
from pathlib import Path
from typing import Any

import msgspec

from app.drive.precheck import check_services, check_settings
from drivemcp.config import settings_of
from drivemcp.errors import UserError
from drivemcp.files.models import digest_of
from evaluation.baselines.direct import cassette
from evaluation.campaign import published
from evaluation.campaign.names import PROPOSER, QUICK_S, TABLES, TableName
from evaluation.campaign.plan import FIXED, Amount, Row, as_asked, latencies_of, rows_of, with_settings
from evaluation.campaign.published import Line
from evaluation.report.plots import figure_of
from evaluation.run.behaviour import behaviour
from evaluation.run.host import NOT_NEEDED
from evaluation.run.methods import (
    ABLATIONS,
    METHODS,
    OBEDIENT,
    PROPOSERS,
    answers_prompts,
    by_language_model,
    kind_of_answers,
)
from evaluation.run.spec import RunSpec
from proto.services import SERVICES


def tables_of(name: str) -> tuple[TableName, ...]:
    """The tables that TABLE names."""
    return TABLES if name == "all" else (name,)  # type: ignore[return-value]


def rows(name: TableName, flags: argparse.Namespace) -> Iterator[Row]:
    """The table's rows, with the settings and latencies that are the user's. Raises UserError for an unknown method."""
    _known("--method", flags.method, {*METHODS, OBEDIENT.label, *ABLATIONS, *(PROPOSERS if name == PROPOSER else ())})
    latencies, answers = latencies_of(flags.latencies), answers_of(flags)
    for row in rows_of(name, flags.sensors):
        spec = by_language_model(row.spec, flags.language_model or "gguf")
        if spec is not None and (not flags.method or row.spec.method in flags.method):
            yield msgspec.structs.replace(row, spec=answers(as_asked(spec, latencies, flags.set)))


def cassette_of(flags: argparse.Namespace) -> str:
    """The recorded answers by name and digest, and the behaviour that they belong to; empty: none drive the runs."""
    if not flags.answers:
        return ""
    file = Path(flags.answers)
    return f"{file.name}, SHA-256 {digest_of(file)[:16]}, at behaviour {behaviour()}"


def answers_of(flags: argparse.Namespace) -> Callable[[RunSpec], RunSpec]:
    """What records or plays the answers of a run that has any. Raises UserError for a cassette that cannot be read."""
    if flags.record_answers and flags.answers:
        raise UserError("--record-answers and --answers: a run records its answers or plays them")
    lines = cassette.read(Path(flags.answers)) if flags.answers else []
    if flags.record_answers:
        cassette.Recording(Path(flags.record_answers), backend="", at=behaviour())  # a new file notes the behaviour

    def with_answers(spec: RunSpec) -> RunSpec:
        if not answers_prompts(spec) or not (flags.record_answers or flags.answers):
            return spec
        if flags.record_answers:
            return with_settings(spec, "drivelm", {"answers": {"record": flags.record_answers}})
        model = cassette.model_of(lines, kind := kind_of_answers(spec))
        if not model:
            raise UserError(f"--answers {flags.answers}: it has no answers of {kind}, by which {spec.method} is driven")
        return with_settings(spec, "drivelm", {"answers": {"play": flags.answers, "model": model}})

    return with_answers


def recorded_otherwise(flags: argparse.Namespace) -> str:
    """What to know where the answers were recorded at another behaviour than today's; empty: nothing."""
    at = cassette.recorded_at(Path(flags.answers)) if flags.answers else ""
    if at in ("", behaviour()):
        return ""
    return (
        f"{flags.answers} was recorded at behaviour {at}, and today's is {behaviour()}: runs in which a prompt has changed fail. "
        "Drive them at the commit of that behaviour, or record anew with --record-answers."
    )


def check(flags: argparse.Namespace) -> None:
    """Raises UserError for what would be found out after hours, or would be ignored."""
    figure_of((1, 1), (1.0, 1.0))
    _check_settings(flags)
    _check_amount(flags)
    if flags.ray and flags.record_answers:
        raise UserError(
            "--record-answers: beside --ray the runs are on other machines, and each would write a file of its own"
        )
    if flags.ray and flags.jobs is not None:
        raise UserError("--jobs: beside --ray the cluster says how many runs are driven side by side")


def settings_in_runs(pairs: Sequence[str]) -> dict[str, dict[str, Any]]:
    """SERVICE.KEY=VALUE by service, for all runs. Raises UserError for what no run would take."""
    asked = settings_of(pairs)
    check_services((), (), asked)
    started = {row.name for row in SERVICES} - {*NOT_NEEDED}
    for service in asked:
        if service not in started:
            raise UserError(f"--set {service}: no run starts that service")
    check_settings(asked, strict=True)
    if asked.get("drivelm", {}).get("backend", "embedded") != "embedded":
        raise UserError(
            "--set drivelm.backend: runs are in lockstep, which no other backend is for; drivelm.prompt_backend has one"
        )
    return asked


def _check_settings(flags: argparse.Namespace) -> None:
    asked = settings_in_runs(flags.set)
    for row in (row for name in tables_of(flags.table) for row in rows_of(name, flags.sensors)):
        for key in _set_twice(asked, row.spec.settings):
            makes = f"it makes the row {row.label!r} of the table {row.table} what it is"
            raise UserError(f"--set {key}: {makes}, and in all rows their labels would be wrong")


def _set_twice(asked: Mapping[str, Any], fixed: Mapping[str, Any]) -> Iterator[str]:
    """The settings, by their dotted names, that both have."""
    for key in asked.keys() & fixed.keys():
        inner, outer = asked[key], fixed[key]
        if isinstance(inner, dict) and isinstance(outer, dict):
            yield from (f"{key}.{each}" for each in _set_twice(inner, outer))
        else:
            yield key


def _check_amount(flags: argparse.Namespace) -> None:
    if flags.quick and (flags.km is not None or flags.runs_of or flags.km_of):
        raise UserError(f"--quick drives {QUICK_S:g} s a run: --km, --runs-of and --km-of have no place beside it")
    for table, _ in flags.runs_of:
        if table not in tables_of(flags.table):
            raise UserError(f"--runs-of {table}: only {flags.table} was asked for")
        if not list(rows(table, flags)):
            raise UserError(f"--runs-of {table}: that table has no row of {', '.join(flags.method)}")
    if flags.km_of and "results" not in tables_of(flags.table):
        raise UserError(f"--km-of: only the table results has it, and {flags.table} was asked for")
    for method, _ in flags.km_of:
        if flags.method and method not in flags.method:
            raise UserError(f"--km-of {method}: --method leaves its rows out")


def check_again(flags: argparse.Namespace, lines: Mapping[str, Line], wanted: Collection[str]) -> None:
    """Raises UserError for a run that would not be driven again."""
    for key in flags.again:
        if key != published.ALL and key not in wanted:
            code = (
                ""
                if key not in lines or lines[key].of_today
                else "; it is of other behaviour, and has another key today"
            )
            raise UserError(f"--again {key}: none of these tables' runs{code}")


def amount(flags: argparse.Namespace) -> Amount:
    """How much of each row. Raises UserError for an unknown method."""
    first = flags.first or 0
    if flags.quick:
        return Amount(runs=flags.runs or 1, seconds=QUICK_S, first=first)
    _known("--km-of", [method for method, _ in flags.km_of], {*METHODS, OBEDIENT.label})
    return Amount(runs=flags.runs, km=flags.km, runs_of=dict(flags.runs_of), km_of=dict(flags.km_of), first=first)


def _known(flag: str, methods: Sequence[str], known: Set[str]) -> None:
    unknown = [method for method in methods if method not in known]
    if unknown:
        raise UserError(f"{flag}: there is no method {unknown[0]!r}; there are {', '.join(sorted(known))}")


def command_line(flags: argparse.Namespace) -> str:
    """The command, for report and page; without where it writes."""
    words = ["drivemcp", "evaluate", flags.table]
    words += ["--from", str(flags.first)] if flags.first else []
    for name in ("runs", "km"):
        words += [f"--{name}", f"{getattr(flags, name):.12g}"] if getattr(flags, name) is not None else []
    words += [word for table, runs in flags.runs_of for word in ("--runs-of", f"{table}={runs}")]
    words += [word for method, km in flags.km_of for word in ("--km-of", f"{method}={km:.12g}")]
    words += [word for method in flags.method for word in ("--method", method)]
    words += ["--sensors", flags.sensors] + (["--quick"] if flags.quick else [])
    words += ["--latencies", flags.latencies] if flags.latencies != FIXED else []
    words += [word for setting in flags.set for word in ("--set", setting)]
    words += ["--language-model", flags.language_model] if flags.language_model else []
    words += ["--record-answers", flags.record_answers] if flags.record_answers else []
    words += ["--answers", flags.answers] if flags.answers else []
    words += ["--published", flags.published] if flags.published else []
    return shlex.join(words)
