"""`python -m studies gvqa.export LOG... OUT.json`: the scene graphs of a drive's log as a file of DriveLM's form.

A scene is a log file, a key frame a graph under its time stamp in nanoseconds. Scores stay in the log: the form has no
place for them. Pictures are not written; `image_paths` only names the frame.
"""

import argparse
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path

import msgspec

from drivemcp.errors import MALFORMED, UserError
from proto import topics
from proto.scene import SceneGraph
from services.logger.format.reader import messages
from services.logger.writing.log_folder import named
from studies.gvqa.drivelm_json import Scene, to_drivelm


def scenes(paths: Iterable[Path]) -> dict[str, Scene]:
    """The graphs of each file. Raises UserError where a file is no log or holds a graph of another form."""
    read = {path.stem: _graphs(path) for path in paths}
    return {name: Scene(next(iter(found.values())).description, found) for name, found in read.items() if found}


def _graphs(path: Path) -> dict[str, SceneGraph]:
    decoder = msgspec.json.Decoder(SceneGraph)
    try:
        return {
            str(logged.stamp_ns): decoder.decode(logged.data)
            for logged in messages(path)
            if logged.name == topics.GRAPH.name
        }
    except MALFORMED as error:
        raise UserError(f"{path}: a scene graph does not fit this version: {error}") from None


def main(arguments: Sequence[str]) -> int:
    """Export. Exit status: 0 written, 2 it cannot be."""
    parser = argparse.ArgumentParser(prog="python -m studies gvqa.export", description=__doc__)
    parser.add_argument("logs", nargs="+", metavar="LOG", help="log files, or the folder of a drive")
    parser.add_argument("out", type=Path)
    flags = parser.parse_args(arguments)
    try:
        found = scenes(named(flags.logs))
        if not found:
            raise UserError("no scene graphs in this log")
        flags.out.write_bytes(msgspec.json.format(msgspec.json.encode(to_drivelm(found))))
    except (UserError, OSError) as error:
        sys.stderr.write(f"studies.gvqa.export: {error}\n")
        return 2
    count = sum(len(scene.frames) for scene in found.values())
    sys.stdout.write(f"{flags.out}: {count} key frames of {len(found)} logs\n")
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
