"""The page: one file without a script, that asks no other host for anything."""

from pathlib import Path
from typing import Any

from jinja2 import Environment, FileSystemLoader, StrictUndefined

from app.audit import checked_lines
from app.replay.again import AtHand
from app.report import story, timeline
from app.report.drive_log import DriveLog

HERE = Path(__file__).parent


def page(log: DriveLog, at_hand: AtHand) -> str:
    """The HTML of a drive's report."""
    environment = Environment(
        loader=FileSystemLoader(HERE), autoescape=True, undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True
    )
    sound, lines = checked_lines(log.files)
    counts = story.counts(log)
    values: dict[str, Any] = {
        "css": (HERE / "report.css").read_text(encoding="utf-8"),
        "log": log,
        "counts": counts,
        "sound": sound,
        "verification": lines,
        "plot": None if log.withheld else timeline.timeline(log.ticks, counts.unit),
        "size": (timeline.WIDTH, timeline.HEIGHT, timeline.LEFT, timeline.RIGHT, timeline.TOP, timeline.BOTTOM),
        "stories": story.stories(log, at_hand),
        "degraded": story.degraded_by(log.ticks),
        "tools": story.tools_of(log),
        "versions": story.versions_of(log.ticks),
        "settings": story.settings_of(log),
        "files": " ".join(str(path) for path in log.files),
    }
    return environment.get_template("report.html.jinja").render(values)
