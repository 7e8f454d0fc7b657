"""What the backend uses of llama_cpp, played by letters: a stand-in where the library is not installed."""

import ctypes
import re
from collections.abc import Callable, Iterator
from importlib.machinery import ModuleSpec
from types import ModuleType
from typing import Any

VOCABULARY = 128
LIKELY = 12.0


class Grammar:
    """One literal, and the end of the line."""

    def __init__(self, text: str) -> None:
        found = re.search(r'root ::= "([a-z.]+)"', text)
        assert found is not None
        self.literal = found[1] + "\n"

    @classmethod
    def from_string(cls, text: str, verbose: bool = True) -> "Grammar":
        """As the library reads it."""
        return cls(text)


class Llama:
    """Goes on with the letter that follows, by the table that the file holds."""

    def __init__(self, model_path: str, **_: Any) -> None:
        with open(model_path, encoding="utf-8") as file:
            first, *rest = file.read().splitlines()
        if first != "stand-in":
            raise ValueError(f"Failed to load model from file: {model_path}")
        self.follows = dict(line.split(" ") for line in rest)
        self.ctx, self.n_tokens, self.evaluated = self, 0, list[int]()
        self.abort: Callable[[Any], bool] = lambda _: False

    def n_vocab(self) -> int:
        """Letters of ASCII."""
        return VOCABULARY

    def token_eos(self) -> int:
        """No letter."""
        return 4

    def tokenize(self, text: bytes, add_bos: bool, special: bool) -> list[int]:
        """A token a letter."""
        return [1] * add_bos + list(text)

    def detokenize(self, tokens: list[int]) -> bytes:
        """The letters."""
        return bytes(tokens)

    def reset(self) -> None:
        """Forget."""
        self.n_tokens, self.evaluated = 0, []

    def eval(self, tokens: list[int]) -> None:
        """Read on."""
        if self.abort(None):
            raise RuntimeError("llama_decode returned 2")
        self.evaluated = [*self.evaluated[: self.n_tokens], *tokens]
        self.n_tokens = len(self.evaluated)

    def generate(self, tokens: list[int], temp: float, grammar: Grammar | None) -> Iterator[int]:
        """The likeliest token after token, or the grammar's."""
        assert temp == 0.0
        assert tokens[: self.n_tokens] == self.evaluated[: self.n_tokens]
        self.eval(tokens[self.n_tokens :])
        held = list(grammar.literal) if grammar is not None else []
        while True:
            token = ord(held.pop(0)) if held else self._next()
            yield token
            self.eval([token])

    def _next(self) -> int:
        return ord(self.follows.get(chr(self.evaluated[-1]), "\n"))

    def logits(self) -> list[float]:
        """The one that follows is likely, all others alike."""
        return [LIKELY if token == self._next() else 0.0 for token in range(VOCABULARY)]


def module() -> ModuleType:
    """The stand-in as the module `llama_cpp`."""
    made: Any = ModuleType("llama_cpp")
    made.__spec__ = ModuleSpec("llama_cpp", None)
    made.Llama, made.LlamaGrammar, made.ggml_abort_callback = Llama, Grammar, lambda call: call

    def set_abort(context: Llama, call: Callable[[Any], bool], _: None) -> None:
        context.abort = call

    def logits(context: Llama, _: int) -> Any:
        return ctypes.cast((ctypes.c_float * VOCABULARY)(*context.logits()), ctypes.POINTER(ctypes.c_float))

    made.llama_set_abort_callback, made.llama_get_logits_ith = set_abort, logits
    return made  # type: ignore[no-any-return]


def write(file: Any, follows: dict[str, str]) -> None:
    """A file that the stand-in loads."""
    file.write_text("stand-in\n" + "".join(f"{a} {b}\n" for a, b in follows.items()), encoding="utf-8")
