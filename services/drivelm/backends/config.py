"""Settings of the backends beside the embedded one."""

from typing import Annotated, Literal

import msgspec

Seconds = Annotated[float, msgspec.Meta(gt=0, le=120)]
Tokens = Annotated[int, msgspec.Meta(ge=1, le=512)]


class TransformersConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`drivelm.transformers`: a local checkpoint of a chat-style vision-language model."""

    folder: str = ""
    """Folder of the checkpoint: configuration, safetensors, processor, tokenizer with a chat template."""
    device: str = "cpu"
    """As torch names it."""
    threads: Annotated[int, msgspec.Meta(ge=1, le=256)] = 1
    """Processor cores that the model may use; the rest is left to the ticks."""
    max_tokens: Tokens = 48
    """Tokens of an answer at most."""
    timeout_s: Seconds = 10.0
    """After which no further token of an answer is begun; what is unfinished is an abstention."""


class OpenaiConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`drivelm.openai`: an endpoint that speaks the OpenAI chat protocol."""

    base_url: str = ""
    """For example `http://127.0.0.1:8000/v1`. There is no default: pictures go nowhere unless told."""
    model: str = ""
    """Name of the model at the endpoint."""
    key_file: str = ""
    """File that holds the key; or:"""
    key_variable: str = ""
    """name of the environment variable that holds it. Neither: no key is sent."""
    allow_plain_http: bool = False
    """Allow http to another computer: pictures and key are then readable on the way."""
    max_tokens: Tokens = 48
    """Tokens of an answer at most."""
    timeout_s: Seconds = 5.0
    """For a whole answer, from connecting to its last byte."""
    logprobs: bool = True
    """Ask for token probabilities; an endpoint that refuses them is asked without."""
    pictures: bool = True
    """Send the picture with a whole prompt. Off: for models without eyes, and for drives without pictures."""


class GgufConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`drivelm.gguf`: a language model in this process, from a GGUF file; for whole prompts alone, and without pictures."""

    file: str = ""
    """A GGUF file; empty: the model `gemma3-270m` of `drivemcp models`."""
    sha256: Annotated[str, msgspec.Meta(pattern=r"^([0-9a-f]{64})?$")] = ""
    """What the file must have; empty: not compared. That of `gemma3-270m` is compared with the table of models always."""
    accept_terms: bool = False
    """Accept the terms of the weights of `gemma3-270m`, as `drivemcp models pull gemma3-270m --accept-terms` does."""
    threads: Annotated[int, msgspec.Meta(ge=1, le=256)] = 1
    """Processor cores that the model may use."""
    timeout_s: Seconds = 10.0
    """For a whole answer, the reading of the prompt included; what is unfinished is an abstention."""
    max_tokens: Tokens = 48
    """Of an answer; one that goes on is an abstention."""
    context: Annotated[int, msgspec.Meta(ge=256, le=131_072)] = 4096
    """Tokens of prompt and answer together; a longer prompt is an abstention."""
    seed: Annotated[int, msgspec.Meta(ge=0, lt=2**32)] = 0
    """Decoding is greedy, so that it changes nothing unless the library draws somewhere."""
    decoding: Literal["free", "forms"] = "free"
    """`free`: any text up to the end of the line. `forms`: only the sentences that the parser knows, by a grammar."""


class AnswersConfig(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """`drivelm.answers`, for the evaluation: answers to whole prompts that are recorded, or played in place of the model."""

    record: str = ""
    """A cassette into which every answer goes; one that is there already is not asked for again."""
    play: str = ""
    """A cassette from which every answer comes; no model is loaded, and a prompt that is not in it is an error."""
    model: str = ""
    """The backend that is played, by its whole name; empty: the only one of the kind that is set."""
