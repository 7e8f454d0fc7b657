"""`openai`: any OpenAI-compatible chat endpoint. Its answers are text from outside: believed in nothing, only parsed.

One deadline holds for a whole answer, bodies are bounded, redirects are not followed, proxies of the environment are
not used, and compressed bodies are not unpacked. Whatever goes wrong is an abstention with its reason in the log.
The score is the product of the token probabilities where the endpoint gives them (the probability that the model
gives this text), otherwise ``abstentions.UNMEASURED``.
"""

import asyncio
import os
import ssl
from collections.abc import Sequence
from pathlib import Path
from urllib.parse import SplitResult, urlsplit

import httpx2
import msgspec

from drivemcp.errors import MALFORMED, ConfigError
from drivemcp.files.addresses import is_loopback
from services.drivelm.backends import chat
from services.drivelm.backends.abstentions import Said
from services.drivelm.backends.config import OpenaiConfig
from services.drivelm.backends.prompts import PromptedBackend, Prompts
from services.drivelm.reading.crops import Picture
from services.drivelm.vocabulary.text import cleaned

MOST_BODY_BYTES = 262_144
"""An answer is one sentence; with token probabilities a few kilobytes."""
_HEADERS = {"Content-Type": "application/json", "Accept": "application/json", "Accept-Encoding": "identity"}


class OpenaiBackend(PromptedBackend):
    """Asks an endpoint, one request per picture, side by side. Safe to call from several threads."""

    def __init__(self, config: OpenaiConfig, prompts: Prompts) -> None:
        """Raises ConfigError naming the field that is missing or refused."""
        base = _base(config)
        super().__init__(f"openai:{cleaned(config.model, 60)}", prompts)
        self._config = config
        self._url = f"{config.base_url.rstrip('/')}/chat/completions"
        self._key = _key(config)
        self._tls = ssl.create_default_context() if base.scheme == "https" else False
        self._logprobs, self.sees = config.logprobs, config.pictures

    def _say(self, images: Sequence[Picture | None], prompt: str) -> Sequence[Said]:
        said = asyncio.run(self._all(images, prompt))
        if not self._key:
            return said
        return [
            each._replace(text=each.text.replace(self._key, "(key)")) for each in said
        ]  # an echo must not be logged

    async def _all(self, images: Sequence[Picture | None], prompt: str) -> list[Said]:
        async with httpx2.AsyncClient(
            headers=_HEADERS | ({"Authorization": f"Bearer {self._key}"} if self._key else {}),
            timeout=self._config.timeout_s,
            verify=self._tls,
            trust_env=False,
            follow_redirects=False,
        ) as client:
            return list(await asyncio.gather(*(self._one(client, image, prompt) for image in images)))

    async def _one(self, client: httpx2.AsyncClient, image: Picture | None, prompt: str) -> Said:
        try:
            async with asyncio.timeout(self._config.timeout_s):
                status, body = await self._post(client, image, prompt)
            return chat.said(body) if status == 200 else Said(reason=f"status {status}")
        except (TimeoutError, httpx2.TimeoutException):
            return Said(reason="no answer in time")
        except _TooLong:
            return Said(reason="body too long")
        except (httpx2.HTTPError, OSError) as error:
            return Said(reason=f"connection failed, {type(error).__name__}")
        except (*MALFORMED, ValueError):
            return Said(reason="malformed reply")

    async def _post(self, client: httpx2.AsyncClient, image: Picture | None, prompt: str) -> tuple[int, bytes]:
        asked = self._logprobs
        status, body = await self._try(client, image, prompt, logprobs=asked)
        if status == 400 and asked:
            status, body = await self._try(client, image, prompt, logprobs=False)
            self._logprobs = self._logprobs and status != 200
        return status, body

    async def _try(
        self, client: httpx2.AsyncClient, image: Picture | None, prompt: str, *, logprobs: bool
    ) -> tuple[int, bytes]:
        config = self._config
        body = chat.request(image, prompt, config.model, config.max_tokens, logprobs=logprobs)
        async with client.stream("POST", self._url, content=msgspec.json.encode(body)) as response:
            return response.status_code, await _bounded(response)


class _TooLong(Exception):
    """A body beyond all use."""


async def _bounded(response: httpx2.Response) -> bytes:
    body = bytearray()
    async for part in response.aiter_raw():
        body += part
        if len(body) > MOST_BODY_BYTES:
            raise _TooLong
    return bytes(body)


def _base(config: OpenaiConfig) -> SplitResult:
    if not config.base_url:
        raise ConfigError("drivelm.openai.base_url is missing, for example http://127.0.0.1:8000/v1")
    if not config.model:
        raise ConfigError("drivelm.openai.model is missing: the name by which the endpoint knows its model")
    try:
        base = urlsplit(config.base_url)
        host, _ = base.hostname or "", base.port
    except ValueError as error:
        raise ConfigError(f"drivelm.openai.base_url is no URL: {error}") from None
    if base.scheme not in ("http", "https") or not host or base.query or base.fragment:
        raise ConfigError("drivelm.openai.base_url must be http(s)://host[:port]/path and no more")
    if base.username is not None or base.password is not None:
        raise ConfigError("drivelm.openai.base_url must not hold a password; use drivelm.openai.key_file")
    if base.scheme == "http" and not config.allow_plain_http and not is_loopback(host):
        raise ConfigError(
            "drivelm.openai.base_url: http only to this computer; use https, or set drivelm.openai.allow_plain_http"
        )
    return base


def _key(config: OpenaiConfig) -> str:
    if config.key_file and config.key_variable:
        raise ConfigError("drivelm.openai.key_file and drivelm.openai.key_variable are both set; one will do")
    if config.key_variable:
        return _checked(os.environ.get(config.key_variable, ""), "drivelm.openai.key_variable")
    if not config.key_file:
        return ""
    try:
        return _checked(Path(config.key_file).read_text(encoding="utf-8-sig"), "drivelm.openai.key_file")
    except (OSError, UnicodeDecodeError):
        raise ConfigError("drivelm.openai.key_file cannot be read as text") from None


def _checked(text: str, field: str) -> str:
    key = text.strip()
    if not key or not key.isascii() or not key.isprintable() or " " in key:
        raise ConfigError(f"{field} names no key: one line of printable characters")
    return key
