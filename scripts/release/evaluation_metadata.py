"""The version of drivemcp-evaluation and the distribution that it is for: both are drivemcp's own (evaluation/pyproject.toml)."""

import tomllib
from pathlib import Path
from typing import Any

from hatchling.metadata.plugin.interface import MetadataHookInterface


class EvaluationMetadata(MetadataHookInterface):  # type: ignore[misc]
    """Called by hatchling."""

    def update(self, metadata: dict[str, Any]) -> None:
        """Fill in version and dependencies."""
        project = tomllib.loads((Path(self.root).parent / "pyproject.toml").read_text(encoding="utf-8"))["project"]
        metadata["version"] = project["version"]
        metadata["dependencies"] = [f"drivemcp[demo,tables]=={project['version']}"]
