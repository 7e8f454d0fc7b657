"""An engine behind the index: the same answers, and an honest one when it is away."""

import os
import threading
from collections.abc import Iterator
from importlib.util import find_spec
from pathlib import Path

import pytest

from drivemcp.paths import data
from drivemcp.runtime.supervisor import free_port
from proto.rules import Retrieved
from services.retrieval.engines import scaled
from services.retrieval.engines.scaled import Engine
from services.retrieval.engines.server import connect
from services.retrieval.engines.stores import Store, StoreError
from services.retrieval.library import AWAY, LOADING, Library, Request
from services.retrieval.ranking.tuning import Tuning
from tests.unit.services.retrieval.support import WordEncoder

SERVER = os.environ.get("DRIVEMCP_QDRANT_URL", "")
FOLDERS = tuple(data(f"rulepacks/{name}") for name in ("DEU-v1", "DEU-v1-VSL", "GBR-v1"))
TUNING = Tuning(lambdas={"word": {"statutes": 0.4, "signs": 0.6}})
REQUESTS = (
    Request(query="pedestrian at a zebra crossing", jurisdiction="GBR", k=8),
    Request(query="visibility below 50 m in fog", jurisdiction="DEU", language="en", k=8),
    Request(query="Höchstgeschwindigkeit mit trailer", jurisdiction="DEU", language="de", corpus="statutes", k=8),
    Request(query="stop sign 206", corpus="signs", k=8),
    Request(query="speed limit roundabout", jurisdiction="DEU", road_type="motorway", k=8),
    Request(query="speed limit", jurisdiction="DEU", on="1950-01-01"),
    Request(query="speed limit", jurisdiction="DEU", on="2099-01-01", k=8),
    Request(query="nebel", jurisdiction="DEU", k=8),
    Request(query="zzzz qqqq", jurisdiction="GBR", k=8),
    Request(query="", jurisdiction="GBR"),
)


def needs(module: str) -> pytest.MarkDecorator:
    absent = find_spec(module) is None
    return pytest.mark.skipif(absent, reason=f"package {module} is not installed (extra retrieval-qdrant)")


STORES = [
    pytest.param(":memory:", id="client-in-process", marks=needs("qdrant_client")),
    pytest.param("folder", id="embedded", marks=needs("qdrant_edge")),
    pytest.param(
        SERVER,
        id="server",
        marks=[
            needs("qdrant_client"),
            pytest.mark.skipif(not SERVER, reason="no Qdrant server: DRIVEMCP_QDRANT_URL is not set"),
        ],
    ),
]


def library(store: Store, budget_s: float | None = None, folders: tuple[Path, ...] = FOLDERS) -> tuple[Library, Engine]:
    engine = Engine(store, budget_s)
    made = Library(folders, TUNING, status=LOADING, index=engine.index)
    made.use(WordEncoder())
    return made, engine


@pytest.fixture(scope="module")
def plain() -> Library:
    made = Library(FOLDERS, TUNING, status=LOADING)
    made.use(WordEncoder())
    return made


@pytest.fixture(scope="module", params=STORES)
def engine_library(request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory) -> Iterator[Library]:
    url = str(tmp_path_factory.mktemp("edge")) if request.param == "folder" else request.param
    made, engine = library(connect(url))
    yield made
    made.close()
    engine.close()


@pytest.mark.parametrize("asked", REQUESTS, ids=lambda request: request.query[:20] or "empty")
def test_the_engine_answers_as_the_memory_does(plain: Library, engine_library: Library, asked: Request) -> None:
    expected, found = plain.search(asked), engine_library.search(asked)
    assert found.encoder == expected.encoder == "word-1.0"
    assert [passage.score for passage in found.passages] == pytest.approx(
        [passage.score for passage in expected.passages], abs=1e-4
    )
    _same_within_ties(expected, found)


def _same_within_ties(expected: Retrieved, found: Retrieved) -> None:
    lowest = expected.passages[-1].score + 1e-4 if expected.passages else 0.0
    above = [{p.passage_id for p in answer.passages if p.score > lowest} for answer in (expected, found)]
    assert above[0] == above[1]


@needs("qdrant_edge")
def test_what_was_filled_is_found_again_and_another_state_replaces_it(tmp_path: Path) -> None:
    first, engine = library(connect(str(tmp_path)), folders=FOLDERS[2:])
    expected = first.search(REQUESTS[0])
    engine.close()
    (kept,) = tmp_path.iterdir()
    told: list[str] = []
    again = Engine(connect(str(tmp_path)), None, told.append)
    made = Library(FOLDERS[2:], TUNING, status=LOADING, index=again.index)
    made.use(WordEncoder())
    assert made.search(REQUESTS[0]) == expected
    assert told == [f"holds {len(made.packs[FOLDERS[2]])} passages of GBR"]
    assert list(tmp_path.iterdir()) == [kept]
    again.close()


class Broken:
    """Breaks and comes back as told; otherwise the store in the process."""

    def __init__(self) -> None:
        self.works, self.release = False, threading.Event()
        self.release.set()
        self.store = connect(":memory:")
        self.asked = 0

    def __getattr__(self, name: str) -> object:
        def call(*arguments: object) -> object:
            self.asked += 1
            assert self.release.wait(10)
            if not self.works:
                raise StoreError("Qdrant: connection refused")
            return getattr(self.store, name)(*arguments)

        return call

    def close(self) -> None:
        self.store.close()


@needs("qdrant_client")
def test_an_engine_that_is_away_leaves_bm25_says_so_and_is_used_when_it_is_back(
    plain: Library, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(scaled, "RETRY_S", 0.0)
    told: list[str] = []
    store = Broken()
    engine = Engine(store, None, told.append)  # type: ignore[arg-type]
    made = Library(FOLDERS, TUNING, status=LOADING, index=engine.index)
    made.use(WordEncoder())
    away = made.search(REQUESTS[0])
    assert away.encoder == AWAY
    assert away.lambda_ == 0.0
    assert away.passages
    assert all(passage.cosine is None for passage in away.passages)
    assert "connection refused" in told[0]
    store.works = True
    assert made.search(REQUESTS[0]).encoder == "word-1.0"
    store.works = False
    assert made.search(REQUESTS[0]).encoder == "word-1.0"  # remembered
    assert made.search(REQUESTS[1]).encoder == AWAY
    engine.close()


@needs("qdrant_client")
def test_a_dead_engine_is_not_asked_at_every_question() -> None:
    store = Broken()
    made, engine = library(store, folders=FOLDERS[2:])  # type: ignore[arg-type]
    asked = store.asked
    for number in range(20):
        assert made.search(Request(query=f"fog {number}")).encoder == AWAY
    assert store.asked == asked
    engine.close()


@needs("qdrant_client")
def test_an_engine_that_hangs_holds_up_nobody() -> None:
    store = Broken()
    store.works = True
    made, patient = library(store, folders=FOLDERS[2:])  # type: ignore[arg-type]
    assert made.search(REQUESTS[0]).encoder == "word-1.0"
    patient._budget_s = 0.01
    store.release.clear()
    answers = {made.search(Request(query=f"fog {number}", jurisdiction="GBR")).encoder for number in range(10)}
    assert answers == {AWAY}
    store.release.set()
    patient.close()


@needs("qdrant_client")
@pytest.mark.parametrize("scheme", ["", "http://"])
def test_no_server_at_the_address_is_said_in_one_line(scheme: str) -> None:
    store = connect(f"{scheme}127.0.0.1:{free_port()}")
    with pytest.raises(StoreError, match=r"^Qdrant: .*refused") as caught:
        store.holds("x", 1)
    assert "\n" not in str(caught.value)
    store.close()
