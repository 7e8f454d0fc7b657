"""Settings for all tests."""

import os
from pathlib import Path

import pytest
from hypothesis import settings

# CI tries the same examples each time; a developer's run tries new ones, and a failing one becomes a test of its own
settings.register_profile("ci", derandomize=True, deadline=None, print_blob=True)
settings.register_profile("dev", deadline=None, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "dev")


@pytest.fixture(scope="session", autouse=True)
def own_state(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The user's state folder, which holds keys, is the tests' own; the processes that they start inherit it."""
    folder = tmp_path_factory.mktemp("state")
    os.environ["XDG_STATE_HOME"] = str(folder)
    return folder
