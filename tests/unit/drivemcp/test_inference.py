"""Execution providers: named in a configuration, and refused in one line where they are not there."""

import onnxruntime
import pytest

from drivemcp.errors import ConfigError
from drivemcp.inference import PROVIDERS, chosen, open_session
from drivemcp.paths import data
from drivemcp.testing import bus
from services.drivelm.service import SERVICE as DRIVELM
from services.drivelm.service import DrivelmConfig
from services.perception.service import SERVICE as PERCEPTION
from services.perception.service import PerceptionConfig

MISSING = next(name for name, (theirs, _) in PROVIDERS.items() if theirs not in onnxruntime.get_available_providers())


def test_what_the_installed_runtime_lacks_is_refused_in_one_line_with_what_to_install() -> None:
    with bus() as b:
        for service, config in (
            (PERCEPTION, PerceptionConfig(providers=MISSING)),
            (DRIVELM, DrivelmConfig(providers=MISSING)),
        ):
            with pytest.raises(ConfigError, match=f"providers = {MISSING}: .*install") as refused:
                b.start(service, config)
            assert "\n" not in str(refused.value)


@pytest.mark.parametrize("names", ["", "gpu", "cpu,,cpu"])
def test_no_provider_and_an_unknown_one_are_refused(names: str) -> None:
    with pytest.raises(ConfigError, match=r"perception\.providers"):
        chosen(names, "perception.providers")


def test_a_provider_that_does_not_start_is_told(monkeypatch: pytest.MonkeyPatch) -> None:
    """ONNX Runtime itself goes on with the CPU and says so in a warning alone."""
    monkeypatch.setitem(PROVIDERS, "broken", ("AzureExecutionProvider", "none"))

    class Fallen:
        def __init__(self, *args: object, **kwargs: object) -> None: ...

        def get_providers(self) -> list[str]:
            return ["CPUExecutionProvider"]

    monkeypatch.setattr(onnxruntime, "InferenceSession", Fallen)
    with pytest.raises(ConfigError, match="broken does not start"):
        open_session(data("models/reader.onnx"), 1, ("broken",))
