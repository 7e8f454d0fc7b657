"""Subject: one unary gRPC call with the workload as JSON bytes. `python -m benchmarks.peers.grpc_call PORT COUNT`"""

import json
import subprocess
import sys
import time
from concurrent import futures

import grpc

from benchmarks.workload import ARGUMENTS, RESULT

METHOD = "/rules.Rules/ApplicableLimit"


def serve(port: str) -> None:
    """Answer until standard input ends."""
    answer = json.dumps(RESULT).encode()
    handler = grpc.unary_unary_rpc_method_handler(lambda request, context: (json.loads(request), answer)[1])
    server = grpc.server(futures.ThreadPoolExecutor(4))
    server.add_generic_rpc_handlers(
        (grpc.method_handlers_generic_handler("rules.Rules", {"ApplicableLimit": handler}),)
    )
    server.add_insecure_port(f"127.0.0.1:{port}")
    server.start()
    sys.stdin.read()
    server.stop(1)


def main() -> None:
    """Measure."""
    port, count = sys.argv[1], int(sys.argv[2])
    server = subprocess.Popen(
        [sys.executable, "-m", "benchmarks.peers.grpc_call", port, "serve"], stdin=subprocess.PIPE
    )
    payload = json.dumps(ARGUMENTS).encode()
    try:
        with grpc.insecure_channel(f"127.0.0.1:{port}") as channel:
            grpc.channel_ready_future(channel).result(15)
            call = channel.unary_unary(METHOD)
            times: list[float] = []
            for number in range(count + 200):
                started = time.perf_counter()
                json.loads(call(payload, timeout=1))
                if number >= 200:
                    times.append((time.perf_counter() - started) * 1000)
        print(json.dumps({"ms": times}))  # noqa: T201
    finally:
        assert server.stdin is not None
        server.stdin.close()
        server.wait(5)


if __name__ == "__main__":
    if sys.argv[2] == "serve":
        serve(sys.argv[1])
    else:
        main()
