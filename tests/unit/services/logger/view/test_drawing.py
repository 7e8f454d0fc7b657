"""What the live view shows of an advisory: all of it, and text of others as text."""

import string
from typing import Any

import msgspec
import pytest
import rerun as rr
from hypothesis import given
from hypothesis import strategies as st

from proto import topics
from proto.decision import Advisory
from proto.rules import Citation
from services.logger.view.drawing import Drawing, literal

SLOW = Advisory(
    tick=1, snapshot_stamp_ns=1, kind="SPEAK", directive="Slow down", justification="The road is wet.", urgency="advice",
    topic="limit", hazard="", target_mps=10.0, legal_limit=None, unit="km/h", language="en", confidence=0.5,
)  # fmt: skip
CITED = Citation(document="stvo.md", start=10, end=20, excerpt="0123456789", section="§ 3")


def _shown(monkeypatch: pytest.MonkeyPatch, *advisories: Advisory) -> list[str]:
    """The documents that the view shows, one after the other."""
    stream, shown = rr.RecordingStream("test"), list[str]()

    def log(entity: str, *what: Any, **_: Any) -> None:
        if entity == "now":
            shown.append(what[0].text.as_arrow_array().to_pylist()[0])

    drawing = Drawing(stream)
    monkeypatch.setattr(stream, "log", log)
    for number, advisory in enumerate(advisories):
        drawing.record(topics.ADVISORY.name, topics.ADVISORY.name, number, msgspec.json.encode(advisory))
    return shown


@pytest.mark.parametrize("field", ["directive", "justification"])
@pytest.mark.parametrize(
    "text",
    [
        "![.](http://10.0.0.9/t.png)", "[tap to overrule](http://evil.example)", "**ALL CLEAR**", "# ALL CLEAR",
        "<http://evil.example>", "a\n\n# ALL CLEAR", "1. ALL CLEAR", "`x`", "a | b", "\\# c",
    ],
)  # fmt: skip
def test_text_of_an_expert_or_a_model_is_shown_as_it_is(monkeypatch: pytest.MonkeyPatch, field: str, text: str) -> None:
    cited = msgspec.structs.replace(CITED, section=text, excerpt=text)
    told: dict[str, Any] = {field: text, "citations": (cited,), "degraded": (text,)}
    (document,) = _shown(monkeypatch, msgspec.structs.replace(SLOW, **told))
    assert document.count(literal(text)) == 4


@given(st.text(max_size=60))
def test_no_character_that_means_something_to_markdown_is_left_bare(text: str) -> None:
    shown, plain = literal(text), ""
    while shown:
        escaped = shown[0] == "\\"
        character, shown = (shown[1], shown[2:]) if escaped else (shown[0], shown[1:])
        assert escaped == (character in string.punctuation)
        plain += character
    assert plain == " ".join(text.split())


def test_the_same_sentence_on_other_grounds_is_shown_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    replace = msgspec.structs.replace
    grounds = [SLOW, SLOW, replace(SLOW, degraded=("can",)), replace(SLOW, degraded=("can",), citations=(CITED,))]
    documents = _shown(monkeypatch, *grounds, replace(SLOW, degraded=("can",), citations=(CITED,)))
    assert len(documents) == 3
    assert "Missing or late: can" in documents[1]
    assert "0123456789" in documents[2]
