"""`transformers`: a local checkpoint of a chat-style vision-language model; nothing is fetched, no code of it is run.

Weights are read from safetensors only. Pictures are prepared without torchvision, which families whose processor also
takes videos insist on (Qwen-VL, SmolVLM, InternVL): without it they are refused at the start. Decoding is greedy. The score is
the product of the probabilities of the tokens chosen, the ending included: how probable the model holds this
sentence. An answer that does not end within its tokens or its time is an abstention.
"""

import hashlib
import importlib
import threading
import time
from collections.abc import Sequence
from importlib.util import find_spec
from pathlib import Path
from typing import Any

from drivemcp.errors import ConfigError
from services.drivelm.backends.abstentions import Said, probability
from services.drivelm.backends.config import TransformersConfig
from services.drivelm.backends.prompts import PromptedBackend, Prompts
from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.text import cleaned

_UNLOADABLE = (OSError, ValueError, KeyError, TypeError, AttributeError, ImportError, RuntimeError)
"""What loading a broken or foreign checkpoint raises, as transformers 5 does."""
_UNANSWERABLE = (ValueError, KeyError, TypeError, IndexError, RuntimeError, AttributeError)
"""What a checkpoint raises that loads and still does not fit (its template, its processor, memory)."""


class TransformersBackend(PromptedBackend):
    """Asks a model in this process, one picture at a time. Safe to call from several threads, which then wait."""

    def __init__(self, config: TransformersConfig, prompts: Prompts) -> None:
        """Raises ConfigError naming the field that is missing or cannot be used."""
        self._config, self._lock = config, threading.Lock()
        self._torch: Any = importlib.import_module("torch")
        self._torch.set_num_threads(config.threads)
        self._processor, self._model = _loaded(config)
        folder = _folder(config)
        super().__init__(f"transformers:{cleaned(folder.name, 40)}:{_digest(folder)[:12]}", prompts)

    def _say(self, images: Sequence[Picture | None], prompt: str) -> Sequence[Said]:
        with self._lock:
            return [self._one(image, prompt) for image in images]

    def _one(self, image: Picture | None, prompt: str) -> Said:
        try:
            text, score, ended = self._generated(image, prompt)
        except _UNANSWERABLE as error:
            return Said(str(error), reason=f"failed, {type(error).__name__}")
        return Said(text, score, "cut off" if not ended else "no probabilities" if score is None else "")

    def _generated(self, image: Picture | None, prompt: str) -> tuple[str, float | None, bool]:
        """The text, its probability, and whether it came to its end."""
        content = [{"type": "image", "image": image}, {"type": "text", "text": prompt}]
        inputs = self._processor.apply_chat_template(
            [{"role": "user", "content": content}],
            add_generation_prompt=True,
            tokenize=True,
            return_dict=True,
            return_tensors="pt",
        ).to(self._model.device, dtype=self._model.dtype)
        deadline_s = time.monotonic() + self._config.timeout_s
        with self._torch.inference_mode():
            made = self._model.generate(
                **inputs,
                max_new_tokens=self._config.max_tokens,
                max_time=max(0.001, deadline_s - time.monotonic()),
                do_sample=False,
                num_beams=1,
                return_dict_in_generate=True,
                output_logits=True,
            )
        tokens = made.sequences[0, -len(made.logits) :]
        text = self._processor.decode(tokens, skip_special_tokens=True).strip()
        return text, self._score(tokens, made.logits), int(tokens[-1]) in self._endings()

    def _score(self, tokens: Any, logits: Sequence[Any]) -> float | None:
        rows = self._torch.stack([step[0].float() for step in logits]).log_softmax(-1)
        return probability(rows.gather(1, tokens[:, None].to(rows.device))[:, 0].tolist())

    def _endings(self) -> frozenset[int]:
        ending = self._model.generation_config.eos_token_id
        return frozenset(ending if isinstance(ending, list) else [ending])


def _folder(config: TransformersConfig) -> Path:
    if not config.folder:
        raise ConfigError("drivelm.transformers.folder is missing: the folder of a checkpoint")
    folder = Path(config.folder)
    if not (folder / "config.json").is_file():
        raise ConfigError(f"drivelm.transformers.folder: no checkpoint in {config.folder!r} (no config.json)")
    return folder.resolve()


def _loaded(config: TransformersConfig) -> tuple[Any, Any]:
    folder = str(_folder(config))
    library: Any = importlib.import_module("transformers")
    kept = {"local_files_only": True, "trust_remote_code": False}
    try:
        processor = library.AutoProcessor.from_pretrained(folder, backend="pil", **kept)
        model = library.AutoModelForImageTextToText.from_pretrained(folder, use_safetensors=True, dtype="auto", **kept)
        model.to(config.device)
    except _UNLOADABLE as error:
        reason = cleaned(str(error).strip().partition("\n")[0], 160)
        if find_spec("torchvision") is None:
            reason += " (families whose processor takes videos need torchvision, which is not installed)"
        raise ConfigError(
            f"drivelm.transformers: {config.folder!r} on {config.device!r} cannot be loaded: {reason}"
        ) from None
    if not getattr(processor, "chat_template", None):
        raise ConfigError(f"drivelm.transformers.folder: {config.folder!r} has no chat template")
    return processor, model.eval()


def _digest(folder: Path) -> str:
    """SHA-256 over names and digests of configuration and weights."""
    total = hashlib.sha256()
    for path in sorted((*folder.glob("*.json"), *folder.glob("*.jinja"), *folder.glob("*.safetensors"))):
        with path.open("rb") as file:
            total.update(f"{path.name} {hashlib.file_digest(file, 'sha256').hexdigest()}\n".encode())
    return total.hexdigest()
