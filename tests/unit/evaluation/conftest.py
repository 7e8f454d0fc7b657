"""A drive for tests that read its log."""

from pathlib import Path

import pytest

from evaluation.metrics import Recorder, keep
from evaluation.run.host import drive
from evaluation.run.spec import RunSpec


@pytest.fixture(scope="session")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """15 s with modelled sensors, the truth beside the log; to be read only."""
    folder, recorder = tmp_path_factory.mktemp("driven"), Recorder()
    drive(RunSpec(scenario="dynamic-vsl", seed=3, seconds=15.0, sensors="model"), folder, recorder.follow)
    (found,) = folder.glob("**/*.mcap")
    keep(recorder, found.parent)
    return found
