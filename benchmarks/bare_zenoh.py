"""Subject: a bare Zenoh query, no validation, no hashes, no log. `python -m benchmarks.bare_zenoh ENDPOINT MODE COUNT`"""

import json
import subprocess
import sys
import time

import zenoh

from benchmarks.workload import ARGUMENTS, RESULT
from drivemcp.bus.session import zenoh_config
from drivemcp.config import BusConfig

KEY = "bench/tool/rules/applicable_limit"


def serve(endpoint: str, *, router: bool) -> None:
    """The server: replies from the callback."""
    config = BusConfig(connect=(endpoint,)) if router else BusConfig(mode="peer", listen=(endpoint,))
    answer = json.dumps(RESULT).encode()

    def reply(query: zenoh.Query) -> None:
        with query:
            query.reply(KEY, answer)

    with zenoh.open(zenoh_config(config)) as session:
        session.declare_queryable(KEY, zenoh.handlers.Callback(reply, indirect=False), complete=True)
        sys.stdin.read()


def main() -> None:
    """Measure: one declared querier, each reply awaited and decoded."""
    endpoint, mode, count = sys.argv[1], sys.argv[2], int(sys.argv[3])
    router = mode == "router"
    server = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.bare_zenoh", endpoint, "serve", str(int(router))], stdin=subprocess.PIPE
    )
    payload = json.dumps(ARGUMENTS).encode()
    try:
        with zenoh.open(zenoh_config(BusConfig(connect=(endpoint,), mode="client" if router else "peer"))) as session:
            querier = session.declare_querier(
                KEY, timeout=1.0, consolidation=zenoh.ConsolidationMode.NONE, express=True
            )
            deadline = time.monotonic() + 10
            while not any(reply.ok for reply in querier.get(payload=payload)):
                if time.monotonic() > deadline:
                    raise RuntimeError("the server did not come up")
            times: list[float] = []
            for number in range(count + 200):
                started = time.perf_counter()
                for reply in querier.get(payload=payload):
                    assert reply.ok is not None
                    json.loads(reply.ok.payload.to_bytes())
                if number >= 200:
                    times.append((time.perf_counter() - started) * 1000)
        print(json.dumps({"ms": times}))  # noqa: T201
    finally:
        assert server.stdin is not None
        server.stdin.close()
        server.wait(5)


if __name__ == "__main__":
    if sys.argv[2] == "serve":
        serve(sys.argv[1], router=sys.argv[3] == "1")
    else:
        main()
