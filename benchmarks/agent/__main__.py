"""`python -m benchmarks.agent [--base-url URL --model NAME] [--key-env NAME] [--mcp URL] [--out FILE.json]`.

Without a model the script answers. Without `--mcp` the fixed world runs in this process; in another stack other facts hold.
"""

import argparse
import os
import sys
import tempfile
from collections.abc import Sequence
from contextlib import nullcontext
from pathlib import Path

import anyio
import httpx2 as httpx
import msgspec
from mcp.client.client import Client

from benchmarks.agent.questions import Question, Scored, questions
from benchmarks.agent.talking import model, no, scripted
from benchmarks.agent.world import world

TIMEOUT_S = 120.0


class Report(msgspec.Struct, frozen=True, kw_only=True):
    """All outcomes, with the means over the questions."""

    version: int
    """Of the questions."""
    model: str
    tools: float
    facts: float
    questions: tuple[Scored, ...]


def main(arguments: Sequence[str] | None = None) -> int:
    """Ask all questions, print the table; 0 whatever came out, since a benchmark passes no judgement."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.agent", description=__doc__)
    parser.add_argument(
        "--base-url", default="", help="of an OpenAI-compatible server, for example http://127.0.0.1:8000/v1"
    )
    parser.add_argument("--model", default="", help="its name there")
    parser.add_argument("--key-env", default="OPENAI_API_KEY", help="environment variable that holds the key")
    parser.add_argument("--mcp", default="", help="a running gateway instead of the fixed world")
    parser.add_argument("--out", default="", help="the report as JSON")
    flags = parser.parse_args(arguments)
    if bool(flags.base_url) != bool(flags.model):
        parser.error("--base-url and --model go together")
    version, asked = questions()
    with (
        tempfile.TemporaryDirectory() as folder,
        nullcontext(flags.mcp) if flags.mcp else world(Path(folder)) as address,
    ):
        outcomes = anyio.run(ask_all, address, asked, flags.base_url, flags.model, os.environ.get(flags.key_env, ""))
    made = report(version, flags.model or "script", outcomes)
    sys.stdout.write(table(made))
    if flags.out:
        Path(flags.out).write_bytes(msgspec.json.format(msgspec.json.encode(made)))
    return 0


async def ask_all(address: str, asked: Sequence[Question], base_url: str, name: str, key: str) -> list[Scored]:
    """Every question, one after the other."""
    headers = {"authorization": f"Bearer {key}"} if key else {}
    async with (
        httpx.AsyncClient(base_url=base_url, headers=headers, timeout=TIMEOUT_S) as http,
        Client(address, elicitation_callback=no) as client,
    ):
        talker = model(http, name) if name else scripted
        return [await talker(client, each) for each in asked]


def report(version: int, name: str, outcomes: Sequence[Scored]) -> Report:
    """The report of these outcomes."""
    count = max(1, len(outcomes))
    tools, facts = sum(each.tools for each in outcomes) / count, sum(each.facts for each in outcomes) / count
    return Report(version=version, model=name, tools=tools, facts=facts, questions=tuple(outcomes))


def table(made: Report) -> str:
    """The report as a Markdown table."""
    rows = [
        f"| {each.id} | {each.tools:.0%} | {each.facts:.0%} | {', '.join(each.called)} |" for each in made.questions
    ]
    total = f"| **all {len(rows)}, {made.model}** | **{made.tools:.0%}** | **{made.facts:.0%}** | |"
    return "\n".join(["| question | right tools | facts | called |", "|---|---|---|---|", *rows, total, ""])


if __name__ == "__main__":
    sys.exit(main())
