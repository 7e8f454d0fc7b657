"""The OpenAI chat protocol as values: the request for one picture, and what a reply says. No network here."""

import base64
from typing import Any

import cv2
import msgspec

from services.drivelm.backends.abstentions import Said, probability
from services.drivelm.reading.crops import Picture


class Token(msgspec.Struct, frozen=True):
    """One token of the answer and the natural logarithm of its probability."""

    token: str
    logprob: float


class TokenList(msgspec.Struct, frozen=True):
    """Token probabilities of an answer."""

    content: list[Token] | None = None


class Message(msgspec.Struct, frozen=True):
    """What was said."""

    content: str | None = None
    refusal: str | None = None


class Choice(msgspec.Struct, frozen=True):
    """One answer."""

    message: Message
    finish_reason: str | None = None
    logprobs: TokenList | None = None


class Reply(msgspec.Struct, frozen=True):
    """The part of a chat completion that is read; everything else is passed over."""

    choices: list[Choice]


def request(image: Picture | None, prompt: str, model: str, max_tokens: int, *, logprobs: bool) -> dict[str, Any]:
    """The body for a prompt, and for one picture (uint8 H x W x 3, RGB) where there is one, sent as PNG in a data URL."""
    content: list[dict[str, Any]] = [{"type": "text", "text": prompt}]
    if image is not None:
        png = cv2.imencode(".png", cv2.cvtColor(image, cv2.COLOR_RGB2BGR))[1].tobytes()
        url = f"data:image/png;base64,{base64.b64encode(png).decode('ascii')}"
        content.insert(0, {"type": "image_url", "image_url": {"url": url}})
    body = {
        "model": model,
        "messages": [{"role": "user", "content": content}],
        "max_tokens": max_tokens,
        "temperature": 0,
        "n": 1,
        "stream": False,
    }
    return {**body, "logprobs": True} if logprobs else body


def said(body: bytes) -> Said:
    """What a reply says. Raises msgspec.MsgspecError, or what else `errors.MALFORMED` lists, where the body is not a reply."""
    choices = msgspec.json.decode(body, type=Reply).choices
    if len(choices) != 1:
        return Said(reason=f"{len(choices)} choices for one")
    choice = choices[0]
    if choice.message.refusal or choice.finish_reason == "content_filter":
        return Said(reason="refused")
    if choice.finish_reason not in ("stop", None):
        return Said(reason="cut off" if choice.finish_reason == "length" else "not a finished sentence")
    if not (choice.message.content or "").strip():
        return Said(reason="empty answer")
    return Said(text=(choice.message.content or "").strip(), score=_score(choice))


def _score(choice: Choice) -> float | None:
    """The probability of the answer; None where it was not given, or was given for another text."""
    tokens = choice.logprobs.content if choice.logprobs is not None else None
    if not tokens or "".join(each.token for each in tokens).strip() != (choice.message.content or "").strip():
        return None
    return probability([each.logprob for each in tokens])
