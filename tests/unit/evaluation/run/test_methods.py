"""The methods and ablations as settings: each names services and fields that there are."""

import msgspec
import pytest

from drivemcp.registry import load_service
from evaluation.run.methods import ABLATIONS, METHODS, Method, applied, made_with, noted
from evaluation.run.spec import RunSpec, run_key
from proto.services import BY_NAME

ALL = [*METHODS.values(), *ABLATIONS.values()]
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
