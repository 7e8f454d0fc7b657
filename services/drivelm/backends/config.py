"""Settings of the backends beside the embedded one."""

from typing import Annotated

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
