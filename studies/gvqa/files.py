"""The two files: a reference of DriveLM's form, and predictions as DriveLM's file or as its challenge's list of answers."""

import contextlib
from collections import Counter
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any, NamedTuple, TypeVar

import msgspec

from drivemcp.errors import MALFORMED
from drivemcp.files.encodings import encoding_of
from services.drivelm.graph.templates import LAYERS
from studies.gvqa.json_fields import UnreadableGraph, as_list, as_object, as_text, field

T = TypeVar("T")


class Place(NamedTuple):
    """Where a question stands: the `nth` of these words in its frame, and its number over all layers there."""

    scene: str
    frame: str
    question: str
    nth: int

    def __str__(self) -> str:
        return f"{self.scene}/{self.frame}: {self.question}"


class Row(NamedTuple):
    """One question with its answer. `tags` are the challenge's metric numbers, where the file gives them."""

    place: Place
    number: int
    layer: str
    answer: str
    tags: tuple[int, ...] = ()


class Given(NamedTuple):
    """One row of a challenge list: the question's id, its words where they are given, the answer."""

    id: str
    question: str | None
    answer: str


def load(path: Path) -> Any:
    """The JSON value of a file, or the list of those that stand in a line each. Raises ``UnreadableGraph``."""
    try:
        content = path.read_bytes()
        text = content.decode(encoding_of(content), errors="replace").strip()
    except OSError as error:
        raise UnreadableGraph(f"{path}: {error.strerror}") from None
    if not text:
        raise UnreadableGraph(f"{path}: it is empty")
    try:
        return msgspec.json.decode(text)
    except MALFORMED as error:
        with contextlib.suppress(*MALFORMED):
            if len(lines := msgspec.json.Decoder().decode_lines(text)) > 1:
                return lines
        raise UnreadableGraph(f"{path}: not JSON: {error}") from None


def of_file(path: Path, read: Callable[[Any], T]) -> T:
    """What `read` makes of a file. Raises ``UnreadableGraph`` naming the file."""
    document = load(path)
    try:
        return read(document)
    except UnreadableGraph as error:
        raise UnreadableGraph(f"{path}: {error}") from None


def rows(document: Any) -> list[Row]:
    """Every question of a file of DriveLM's form, frames with questions and pictures alone included."""
    found: list[Row] = []
    for scene, body in as_object(document, "the file").items():
        frames, where = field(as_object(body, scene), "key_frames", scene)
        for frame, value in as_object(frames, where).items():
            place = f"{where}.{frame}"
            questions, asked = field(as_object(value, place), "QA", place)
            found += _frame(scene, frame, as_object(questions, asked), asked)
    return found


def _frame(scene: str, frame: str, questions: Mapping[str, Any], where: str) -> Iterator[Row]:
    seen = Counter[str]()
    for number, (layer, value, place) in enumerate(_values(questions, where)):
        row = as_object(value, place)
        question, answer = as_text(*field(row, "Q", place)), as_text(*field(row, "A", place))
        yield Row(Place(scene, frame, question, seen[question]), number, layer, answer, _tags(row, place))
        seen[question] += 1


def _values(questions: Mapping[str, Any], where: str) -> Iterator[tuple[str, Any, str]]:
    for layer in LAYERS:
        for number, value in enumerate(as_list(questions.get(layer) or [], f"{where}.{layer}")):
            yield layer, value, f"{where}.{layer}[{number}]"


def _tags(row: Mapping[str, Any], where: str) -> tuple[int, ...]:
    tags = as_list([] if row.get("tag") is None else row["tag"], f"{where}.tag")
    if not all(type(tag) is int and 0 <= tag <= 3 for tag in tags):
        raise UnreadableGraph(f"{where}.tag: expected numbers 0 to 3, found {tags!r:.80}")
    return tuple(tags)


SUBMITTED = ("method", "team", "authors", "email", "institution", "country")
"""What the challenge's submission says beside its `results`."""


def answers_of(predictions: Any) -> list[Any] | None:
    """The rows of the challenge's answers: a list, a single row, or a submission's `results`; None for a file of DriveLM's form."""
    if isinstance(predictions, list):
        return predictions
    if isinstance(predictions, dict) and _given(predictions) is not None:
        return [predictions]
    if isinstance(predictions, dict) and ("results" in predictions or {"method", "team"} <= predictions.keys()):
        return as_list(*field(predictions, "results", "the submission"))
    return None


def questions_only(document: Any) -> Any:
    """A test file of the challenge, which has no answers and may have no objects, with these empty."""
    scenes = as_object(document, "the file")
    return {name: _scene(as_object(body, name), name) for name, body in scenes.items()}


def _scene(body: dict[str, Any], where: str) -> dict[str, Any]:
    frames, place = field(body, "key_frames", where)
    filled = {
        key: _asked(as_object(frame, f"{place}.{key}"), f"{place}.{key}")
        for key, frame in as_object(frames, place).items()
    }
    return {**body, "scene_description": body.get("scene_description") or "", "key_frames": filled}


def _asked(frame: dict[str, Any], where: str) -> dict[str, Any]:
    questions, place = field(frame, "QA", where)
    asked = {
        layer: [
            {**row, "A": row.get("A") or ""} if isinstance(row, dict) else row
            for row in as_list(found or [], f"{place}.{layer}")
        ]
        if layer in LAYERS
        else found
        for layer, found in as_object(questions, place).items()
    }
    return {**frame, "key_object_infos": frame.get("key_object_infos") or {}, "QA": asked}


def given(values: list[Any]) -> tuple[list[Given], int]:
    """The rows of a challenge list, and how many are of a wrong form."""
    read = [_given(value) for value in values]
    kept = [one for one in read if one is not None]
    return kept, len(read) - len(kept)


def _given(value: Any) -> Given | None:
    """A row of the challenge's answers, or of its converted test file, whose turns are under `conversations`."""
    turns = value.get("conversations") if isinstance(value, dict) else None
    if isinstance(turns, list) and all(isinstance(turn, dict) for turn in turns):
        said = {turn.get("from"): turn.get("value") for turn in turns}
        value = {"id": value.get("id"), "question": said.get("human"), "answer": said.get("gpt")}
    if not isinstance(value, dict) or not isinstance(value.get("id"), str) or not isinstance(value.get("answer"), str):
        return None
    question = value.get("question")
    return Given(value["id"], question if isinstance(question, str) else None, value["answer"])
