"""The answer of the tool `answer_prompt`."""

import msgspec

from evaluation.baselines.direct.forms import Action
from proto.scene import Unit


class PromptAnswer(msgspec.Struct, frozen=True, kw_only=True):
    """The answer to a whole prompt, and the advice that the constrained parser finds in it."""

    text: str
    """Empty: an abstention."""
    score: float
    method: str
    backend: str
    prompt_sha256: str
    action: Action = "none"
    """`none`: nothing was understood, so nothing is advised. `limit_ahead`: the limit begins at a sign ahead."""
    value: float | None = None
    unit: Unit | None = None
    hazard: str = ""
    took_ms: float = 0.0
    """What a slow backend took; 0: the embedded reader, whose time is that of the call."""
