"""Settings for all tests."""

import os

from hypothesis import settings

# CI tries the same examples each time; a developer's run tries new ones, and a failing one becomes a test of its own
settings.register_profile("ci", derandomize=True, deadline=None, print_blob=True)
settings.register_profile("dev", deadline=None, print_blob=True)
settings.load_profile("ci" if os.environ.get("CI") else "dev")
