"""The store that an address names."""

import re
from pathlib import Path

from services.retrieval.engines.edge import QdrantEdge
from services.retrieval.engines.server import IN_PROCESS, QdrantServer
from services.retrieval.engines.stores import Store


def connect(url: str, key_file: str = "") -> Store:
    """A server's (`host:port`, http://, https://), or a folder's. Raises ImportError where the packages are absent, OSError for the key."""
    if re.fullmatch(r"[\w.-]+:\d+", url):
        url = f"http://{url}"
    if url == IN_PROCESS or url.startswith(("http://", "https://")):
        return QdrantServer(url, Path(key_file).read_text(encoding="utf-8").strip() if key_file else None)
    return QdrantEdge(Path(url))
