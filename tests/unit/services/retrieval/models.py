"""Tiny models of random weights, written as sentence-transformers writes them: for loading, not for judging."""

import string
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path

import pytest

WORDS = ("fog", "speed", "limit", "zebra", "crossing", "cake", "the", "a")

needs_torch = pytest.mark.skipif(
    any(find_spec(module) is None for module in ("torch", "transformers", "sentence_transformers")),
    reason="sentence-transformers and torch are not installed (extra retrieval-torch)",
)


def sentence_model(folder: Path) -> Path:
    """A sentence encoder of 16 dimensions."""
    package, models = map(import_module, ("sentence_transformers", "sentence_transformers.models"))
    base = _base(folder / "base", labels=0)
    transformer = models.Transformer(str(base), max_seq_length=32)
    made = package.SentenceTransformer(modules=[transformer, models.Pooling(16)], device="cpu")
    made.save(str(folder / "tiny-model"))
    return folder / "tiny-model"


def cross_encoder(folder: Path) -> Path:
    """A cross-encoder with one label."""
    return _base(folder / "tiny-judge", labels=1)


def _base(folder: Path, labels: int) -> Path:
    torch, bert = map(import_module, ("torch", "transformers"))
    folder.mkdir(parents=True)
    vocabulary = ["[PAD]", "[UNK]", "[CLS]", "[SEP]", "[MASK]", *WORDS, *string.ascii_lowercase]
    vocabulary += [f"##{letter}" for letter in string.ascii_lowercase]
    (folder / "vocab.txt").write_text("\n".join(vocabulary), encoding="utf-8")
    torch.manual_seed(1)
    config = bert.BertConfig(
        vocab_size=len(vocabulary),
        max_position_embeddings=64,
        hidden_size=16,
        num_hidden_layers=1,
        num_attention_heads=2,
        intermediate_size=16,
    )
    config.num_labels = max(labels, 1)
    kind = bert.BertForSequenceClassification if labels else bert.BertModel
    kind(config).save_pretrained(folder)
    bert.BertTokenizerFast(str(folder / "vocab.txt"), model_max_length=64).save_pretrained(folder)
    return folder
