"""`drivemcp evaluate TABLE`: drive what is missing, measure, write tables and report. Finished runs are kept and never driven again."""

import argparse

from drivemcp.commands import Subparsers
from drivemcp.errors import UserError
from drivemcp.files.modes import others_denied
from drivemcp.numbers import number, whole
from evaluation.campaign.names import PROPOSER, QUICK_S, TABLES

GUARD, POPULATION, ISA, RELEASE = "guard", "population", "isa", "release"
ALONE = (GUARD, POPULATION, ISA, RELEASE)
"""Tables of the field's yardsticks, and all that a release tells, with modelled sensors as a rule."""
MOST = 100_000
"""Runs, or runs side by side: no campaign has more."""


def register(subparsers: Subparsers) -> None:
    """Add `drivemcp evaluate`."""
    parser = subparsers.add_parser(
        "evaluate",
        help="drive and measure the paper's tables",
        description="Drives what is missing, measures it, and writes CSV, JSON and one HTML report beside the paper's numbers. "
        "Finished runs are kept by spec, models and behaviour lock; interrupted, the same command goes on. "
        "Exit status: 0 all runs are there, 1 some failed or came out otherwise than published, 130 interrupted.",
    )
    parser.add_argument(
        "table",
        choices=(*TABLES, "all", PROPOSER, *ALONE),
        metavar="TABLE",
        help=", ".join((*TABLES, "all")) + f"; or {PROPOSER}: a language model in place of reader and fusion; "
        f"or {GUARD}: what the guard avoids alone, in scenes of the kind of UN Regulation 152; "
        f"or {POPULATION}: drivers of four kinds at hazards and on routes; "
        f"or {ISA}: what is shown and said of limits, by the rules of speed assistance; "
        f"or {RELEASE}: {ISA} and {GUARD} whole, then all tables with as many runs a row as --hours give, in as many sittings as it takes",
    )
    parser.add_argument(
        "--hours", type=number(0.0, 10_000.0), help="of the table release: for all sittings together (12)"
    )
    parser.add_argument(
        "--seeds", type=whole(1, MOST), help="runs a cell of the table guard (20, rendered 3, with --quick 1)"
    )
    parser.add_argument(
        "--beside",
        action="store_true",
        help="of the table guard: the same runs with a governor by RSS alone and with IDM in the guard's place, thrice the time",
    )
    parser.add_argument("--windows", type=whole(1, MOST), help="hazards of the table population (16)")
    parser.add_argument(
        "--population",
        choices=("absent", "attentive", "startled", "slow"),
        action="append",
        default=[],
        help="of the table population this kind of drivers alone; more than once",
    )
    parser.add_argument(
        "--by",
        choices=("delta", "ablation"),
        help="of the table population each row of that table, with an absent driver, where the arbiter acts",
    )
    parser.add_argument(
        "--from",
        dest="first",
        type=whole(0, MOST),
        metavar="N",
        help="the number of the first place of each family (0)",
    )
    parser.add_argument(
        "--log",
        action="append",
        default=[],
        metavar="FILE.mcap",
        help="of the table isa: what this log tells, in place of driving; its truth counts where it lies beside it; more than once",
    )
    parser.add_argument("--runs", type=whole(1, MOST), help="runs a row (4, or as many as --km takes)")
    parser.add_argument(
        "--km",
        type=number(0.001, 100_000.0),
        help="kilometres a row, by the length of the routes; of the table population beside the windows",
    )
    parser.add_argument(
        "--runs-of",
        type=_table_runs,
        action="append",
        default=[],
        metavar="TABLE=N",
        help="more runs for each row of one table: corruption=8",
    )
    parser.add_argument(
        "--km-of",
        type=_method_km,
        action="append",
        default=[],
        metavar="METHOD=KM",
        help="more kilometres for one method's rows of the results table: DriveMCP=100",
    )
    parser.add_argument(
        "--method", action="append", default=[], metavar="METHOD", help="the rows of this method alone; more than once"
    )
    parser.add_argument("--jobs", type=whole(1, MOST), help="runs side by side (one a core)")
    parser.add_argument("--out", default="out/evaluate", metavar="DIR", help="where runs, tables and report go")
    parser.add_argument(
        "--sensors",
        choices=("rendered", "model"),
        help="rendered; model for the tables proposer, guard, population and isa",
    )
    parser.add_argument(
        "--latencies",
        default="fixed",
        metavar="FILE",
        help="what calls take: `fixed`, 4 ms each, for exact repeats anywhere; or the table of `python -m studies latencies measure`",
    )
    parser.add_argument(
        "--quick", action="store_true", help=f"one run of {QUICK_S:g} s a row: shows that all of it works"
    )
    parser.add_argument(
        "--ray", default="", metavar="ADDRESS", help="spread over a Ray cluster; `local` starts one here"
    )
    parser.add_argument(
        "--set",
        action="append",
        default=[],
        metavar="SERVICE.KEY=VALUE",
        help="one setting of one service, in all runs",
    )
    parser.add_argument(
        "--language-model",
        choices=("gguf", "openai", "transformers"),
        help=f"the backend of the language model of the table {PROPOSER} (gguf); its settings by --set drivelm.BACKEND.KEY=VALUE",
    )
    parser.add_argument(
        "--record-answers",
        default="",
        metavar="FILE.jsonl",
        help="record every answer to a whole prompt, by whatever backend; an answer that is in the file is not asked for again",
    )
    parser.add_argument(
        "--answers",
        default="",
        metavar="FILE.jsonl[.gz]",
        help="drive by the recorded answers in place of the models: the same rows, to the bit; a prompt without an answer fails its run",
    )
    parser.add_argument(
        "--published",
        default="",
        metavar="FILE",
        help="runs that were driven before or elsewhere: those of this behaviour and these models are not driven again",
    )
    parser.add_argument(
        "--again",
        action="append",
        default=[],
        metavar="KEY",
        help="drive a published run here all the same, for its log and to compare; more than once, or `all`",
    )
    parser.add_argument(
        "--publish", default="", metavar="FILE", help="add the runs of these tables to FILE.jsonl or FILE.jsonl.gz"
    )
    parser.add_argument(
        "--docs",
        default="",
        metavar="FILE",
        help="write the results as a page of the docs, too, with its plots in the folder beside it that has its name",
    )
    parser.set_defaults(run=command)


def _table_runs(text: str) -> tuple[str, int]:
    table, equals, runs = text.rpartition("=")
    if not equals or table not in TABLES:
        raise argparse.ArgumentTypeError(f"TABLE=N with TABLE one of {', '.join(TABLES)}, not {text!r}")
    return table, whole(1, MOST)(runs)


def _method_km(text: str) -> tuple[str, float]:
    method, equals, km = text.rpartition("=")
    if not equals:
        raise argparse.ArgumentTypeError(f"METHOD=KM, not {text!r}")
    return method, number(0.001, 100_000.0)(km)


def command(flags: argparse.Namespace) -> int:
    """Drive, measure, write. Raises UserError where a module is not installed."""
    flags.sensors = flags.sensors or ("model" if flags.table in (*ALONE, PROPOSER) else "rendered")
    if flags.table != GUARD and flags.seeds is not None:
        raise UserError(f"--seeds: the table {flags.table} has none; --runs says how many runs a row has")
    if flags.table != GUARD and flags.beside:
        raise UserError(f"--beside: the table {flags.table} has no such columns; the table {GUARD} has")
    if flags.table != POPULATION and (flags.windows is not None or flags.population or flags.by):
        raise UserError(f"--windows, --population, --by: the table {flags.table} has none; the table {POPULATION} has")
    if flags.table == GUARD and flags.first is not None:
        raise UserError(f"--from: the table {GUARD} has scenes of its own, and no places")
    if flags.table != ISA and flags.log:
        raise UserError(f"--log: the table {flags.table} is driven; the table {ISA} reads logs")
    if flags.table != RELEASE and flags.hours is not None:
        raise UserError(f"--hours: the table {flags.table} has none; the table {RELEASE} has")
    if flags.table == RELEASE and (flags.runs or flags.km or flags.runs_of or flags.km_of):
        raise UserError("--runs, --km, --runs-of, --km-of: a release drives as much as --hours give")
    if flags.table != PROPOSER and flags.language_model:
        raise UserError(f"--language-model: the table {flags.table} has none; the table {PROPOSER} has")
    if flags.table in ALONE and (flags.record_answers or flags.answers):
        raise UserError(f"--record-answers, --answers: no row of the table {flags.table} answers prompts")
    if flags.log and (flags.quick or flags.runs or flags.first):
        raise UserError("--log: a log was driven before; --quick, --runs and --from have no place beside it")
    try:
        if flags.table == ISA:
            from evaluation.isa.isa import evaluate_isa as evaluate
        elif flags.table == GUARD:
            from evaluation.guard.guard import evaluate_guard as evaluate
        elif flags.table == POPULATION:
            from evaluation.population.population import evaluate_population as evaluate
        elif flags.table == RELEASE:
            from evaluation.evaluate.release import evaluate_release as evaluate
        else:
            from evaluation.evaluate.whole import evaluate  # takes seconds: every other command would wait for it
    except ModuleNotFoundError as error:
        raise UserError(
            f"`drivemcp evaluate` needs the module {error.name!r}: pip install 'drivemcp[demo,tables]'"
        ) from error
    try:
        with others_denied():
            return evaluate(flags)
    except BrokenPipeError:
        raise
    except OSError as error:
        raise UserError(f"{error.filename or flags.out}: {error.strerror or error}") from error
