"""The methods and ablations as settings: each names services and fields that there are."""

import msgspec
import pytest

from drivemcp.registry import load_service
from evaluation.run.methods import (
    ABLATIONS,
    METHODS,
    PROPOSERS,
    Method,
    applied,
    by_language_model,
    kind_of_answers,
    made_with,
    noted,
)
from evaluation.run.spec import RunSpec, run_key
from proto.services import BY_NAME

ALL = [*METHODS.values(), *ABLATIONS.values(), *PROPOSERS.values()]
SPEC = RunSpec(scenario="dynamic-vsl", settings={"arbiter": {"delta": 0.1}}, without=("gateway",))


@pytest.mark.parametrize("method", ALL, ids=lambda method: method.label)
def test_its_settings_are_taken_by_the_services_and_what_it_leaves_out_is_there(method: Method) -> None:
    spec = applied(method, SPEC)
    for name, fields in spec.settings.items():
        msgspec.convert({"lockstep": True, **fields}, load_service(name).config)
    assert set(spec.without) <= set(BY_NAME)
    assert not set(spec.without) & set(method.settings)
    assert spec.settings["arbiter"]["delta"] == 0.1
    assert (spec.method, spec.seed, spec.scenario) == (method.label, SPEC.seed, SPEC.scenario)
    assert method.note


def test_every_row_is_another_run_and_the_full_system_is_the_run_as_it_is() -> None:
    keys = [run_key(applied(method, SPEC)) for method in METHODS.values()]
    assert len(set(keys)) == len(METHODS)
    assert applied(METHODS["DriveMCP"], SPEC) == SPEC
    assert "gateway" in applied(METHODS["VLM-Direct"], SPEC).without


DIRECT = ("VLM-Direct", "VLM-Direct+RAG")


@pytest.mark.parametrize(
    ("drivelm", "direct", "others"),
    [
        ({}, "embedded", "embedded"),
        ({"backend": "transformers"}, "transformers", "transformers"),
        ({"prompt_backend": "openai"}, "openai", "embedded"),
        ({"backend": "transformers", "prompt_backend": "embedded"}, "embedded", "transformers"),
    ],
)
def test_rows_name_the_backend_that_made_them_and_an_extractive_reader_is_called_so(
    drivelm: dict[str, str], direct: str, others: str
) -> None:
    for name, method in METHODS.items():
        spec = applied(method, RunSpec(scenario="dynamic-vsl", settings={"drivelm": drivelm}))
        assert made_with(spec) == (direct if name in DIRECT else others)
        extractive = name in DIRECT and direct == "embedded"
        assert ("no language model" in noted(method.note, spec)) == extractive


WORDED = [label for label in PROPOSERS if label.startswith("LM-")]


@pytest.mark.parametrize("label", WORDED)
def test_rows_of_a_language_model_say_what_it_is_and_are_recorded_under_its_name(label: str) -> None:
    spec = applied(PROPOSERS[label], SPEC)
    assert kind_of_answers(spec) == f"gguf:{label.rpartition(' ')[2]}"
    assert made_with(spec) == "gguf"
    note = noted(PROPOSERS[label].note, spec)
    assert "270 million parameters" in note
    assert "no picture" in note
    played = {
        **spec.settings,
        "drivelm": {**spec.settings["drivelm"], "answers": {"play": "a", "model": "gguf:free:x"}},
    }
    assert made_with(msgspec.structs.replace(spec, settings=played)) == "gguf:free:x"


def test_another_backend_takes_the_rows_of_the_language_model_where_no_grammar_is_asked_for() -> None:
    for label, method in PROPOSERS.items():
        spec = applied(method, SPEC)
        other = by_language_model(spec, "openai")
        assert by_language_model(spec, "gguf") == spec
        if label not in WORDED:
            assert other == spec
        elif label.endswith("forms"):
            assert other is None
        else:
            assert other is not None
            assert made_with(other) == "openai"
            assert "270" not in noted(method.note, other)


def test_our_fusion_without_the_arbiter_is_the_same_run_in_both_tables() -> None:
    for label in ("VLM-Tools-NoArbiter", "DriveMCP", "VLM-Direct", "No-assistant"):
        assert run_key(applied(PROPOSERS[label], SPEC)) == run_key(applied(METHODS[label], SPEC))
