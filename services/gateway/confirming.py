"""Before anything that changes the world a person is asked: what will be done, to what, for how long. No answer is a refusal.

The question holds text of this module and the arguments as ASCII JSON, so that no argument can pass for words of the gateway.
The person's client alone answers, with a boolean. An answer counts once, for the call that was shown, within two minutes.
"""

import hashlib
import json
import secrets
import threading
import time
from collections.abc import Callable, Mapping
from typing import Any, NamedTuple

import anyio
import msgspec
from mcp import types
from mcp.server import ServerRequestContext
from mcp.shared.exceptions import MCPError
from mcp_types.version import is_version_at_least

from drivemcp.tools.refusal import refusal
from proto.tools import ToolEntry
from services.gateway.asked_about import described

ANSWER_WITHIN_S = 120.0
MOST_WAITING = 64
LONGEST_CALL = 1000
"""Characters of a call that are shown. A longer one is refused, since a person would confirm what was cut off."""
KEY = "confirm"
_IN_RESULT = "2026-07-28"
"""The revision from which a question goes out as a result and its answer comes with the call again."""
_SCHEMA: types.ElicitRequestedSchema = {
    "type": "object",
    "properties": {
        KEY: {"type": "boolean", "title": "Do it", "description": "Do exactly this, once?", "default": False}
    },
    "required": [KEY],
}


class Call(NamedTuple):
    """A call as it is shown and as it is made."""

    tool: str
    text: str
    """The arguments as canonical ASCII JSON."""

    @property
    def arguments(self) -> dict[str, Any]:
        """What is executed: the text that was shown, decoded."""
        decoded: dict[str, Any] = json.loads(self.text)
        return decoded

    @property
    def sha256(self) -> str:
        """Of tool and arguments."""
        return hashlib.sha256(f"{self.tool}\n{self.text}".encode()).hexdigest()


def as_call(tool: str, arguments: Mapping[str, Any]) -> Call:
    """The call in its one form."""
    return Call(tool, json.dumps(arguments, sort_keys=True, separators=(",", ":"), ensure_ascii=True))


class _State(msgspec.Struct, frozen=True):
    """What goes to the client sealed, and comes back."""

    nonce: str
    sha256: str


class Questions:
    """Questions that wait for their answers. Each is answered once."""

    def __init__(self, now_s: Callable[[], float] = time.monotonic) -> None:
        self._now_s = now_s
        self._lock = threading.Lock()
        self._waiting: dict[str, tuple[str, float]] = {}

    def ask(self, call: Call) -> str:
        """The state of a new question. Of more than `MOST_WAITING` the oldest are forgotten."""
        nonce = secrets.token_hex(16)
        with self._lock:
            self._waiting[nonce] = (call.sha256, self._now_s() + ANSWER_WITHIN_S)
            while len(self._waiting) > MOST_WAITING:
                del self._waiting[next(iter(self._waiting))]
        return msgspec.json.encode(_State(nonce, call.sha256)).decode()

    def take(self, call: Call, state: str) -> bool:
        """Whether a question about exactly this call waits under this state; it does not wait any longer then."""
        try:
            given = msgspec.json.decode(state, type=_State)
        except (msgspec.MsgspecError, UnicodeError):
            return False
        with self._lock:
            sha256, due_s = self._waiting.pop(given.nonce, ("", 0.0))
        return sha256 == call.sha256 == given.sha256 and self._now_s() < due_s


def agreed(answer: object) -> bool:
    """Whether an answer of the client is a yes: accepted, with the boolean and nothing else."""
    if not isinstance(answer, types.ElicitResult) or answer.action != "accept":
        return False
    content = answer.content or {}
    return list(content) == [KEY] and content[KEY] is True


def question(entry: ToolEntry, call: Call, grant: str = "") -> str:
    """What the person reads."""
    what, to, how_long = described(entry, call.arguments)
    lines = [f"What will be done: {what}", f"To what: {to}", f"For how long: {how_long}"]
    lines += [f"Under the grant: {grant}"] if grant else []
    return "\n".join([*lines, f"The exact call (data, no instruction): {call.tool} {call.text}"])


class Confirming:
    """Asks the client's person, over any revision of the protocol that can."""

    def __init__(self, questions: Questions | None = None, *, within_s: float = ANSWER_WITHIN_S) -> None:
        self._questions = questions or Questions()
        self._within_s = within_s

    async def why_not(
        self,
        context: ServerRequestContext[Any],
        params: types.CallToolRequestParams,
        entry: ToolEntry,
        call: Call,
        grant: str = "",
    ) -> types.InputRequiredResult | str:
        """The question that goes out; else why the call is refused, empty where a person said yes to it."""
        if len(call.text) > LONGEST_CALL:
            do = f"keep the arguments below {LONGEST_CALL} characters"
            return refusal(f"{call.tool} changes something, and is too long to be shown to a person", do=do)
        if not is_version_at_least(context.session.protocol_version, _IN_RESULT):
            return await self._ask_now(context, entry, call, grant)
        if params.request_state is not None or params.input_responses is not None:
            waited = self._questions.take(call, params.request_state or "")
            return _verdict(call, waited and agreed((params.input_responses or {}).get(KEY)))
        if not _may_ask(context):
            return _nobody(call)
        form = types.ElicitRequestFormParams(message=question(entry, call, grant), requested_schema=_SCHEMA)
        return types.InputRequiredResult(
            input_requests={KEY: types.ElicitRequest(params=form)}, request_state=self._questions.ask(call)
        )

    async def _ask_now(self, context: ServerRequestContext[Any], entry: ToolEntry, call: Call, grant: str) -> str:
        if not _may_ask(context) or not context.session.can_send_request:
            return _nobody(call)
        try:
            with anyio.fail_after(self._within_s):
                answer = await context.session.elicit_form(question(entry, call, grant), _SCHEMA, context.request_id)
        except (TimeoutError, MCPError):
            return _verdict(call, False)
        return _verdict(call, agreed(answer))


def _may_ask(context: ServerRequestContext[Any]) -> bool:
    """Whether the client says that it shows forms to its person."""
    capabilities = context.session.client_capabilities
    asks = capabilities.elicitation if capabilities is not None else None
    return asks is not None and (asks.form is not None or asks.url is None)


def _verdict(call: Call, agreed_to: bool) -> str:
    do = "do not repeat it by yourself; let the person decide"
    return "" if agreed_to else refusal(f"{call.tool} was not confirmed by a person, and nothing was done", do=do)


def _nobody(call: Call) -> str:
    do = (
        "use a client with elicitation that answers requests of the server, or let a person run "
        f"`drivemcp tools call {call.tool}` at the vehicle"
    )
    return refusal(f"{call.tool} changes something, and this client cannot ask its person", do=do)
