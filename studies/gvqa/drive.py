"""`python -m studies gvqa.drive FOLDER`: our graph's answers about a rendered drive, against a graph made of the truth.

Perception and the embedded front end see the drive; once a second their graph is asked every question of the graph that
the same rules make of what was really there. So the scores tell what seeing and reading lose; that the rules themselves
speak well, they do not tell. FOLDER gets `reference.json` in DriveLM's form and `answers.json` in its challenge's.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path

import msgspec

from drivemcp.errors import UserError
from drivemcp.paths import data
from proto.perception import Tracks
from proto.scene import SceneGraph
from services.drivelm.backends.backend import EmbeddedBackend
from services.drivelm.front_end import FrontEnd, Sighting
from services.drivelm.graph.answering import ask
from services.drivelm.graph.nodes import RecentFacts
from services.drivelm.graph.scene_graph import Seen, build
from services.drivelm.graph.templates import recognise
from services.drivelm.reading.reader import Reader
from services.perception.checks.decoding import open_picture
from services.perception.detect.loading import load_detector
from services.perception.pipeline import FRONT, Perception
from services.simulator.render import RendererUnavailable
from services.simulator.sensors import measurements
from services.simulator.session import CAMERAS
from studies.gvqa.answer import Answered, as_challenge, sheet
from studies.gvqa.command import sheet as scores_sheet
from studies.gvqa.drivelm_json import Scene, to_drivelm
from studies.gvqa.files import rows
from studies.gvqa.pairing import pair
from studies.gvqa.scores import report
from studies.gvqa.truth import true_graph
from studies.output import add_json, show
from studies.tracking.recording import DriveName, Look, Step, record

EVERY_NS = 1_000_000_000
Graphs = tuple[SceneGraph, SceneGraph]


class Eyes:
    """Perception and front end over a drive, with what they last said."""

    def __init__(self) -> None:
        self.perception = Perception(load_detector(data("models/detector.onnx")))
        self.front_end = FrontEnd(EmbeddedBackend(Reader.load(data("models/reader.onnx"))), home="DEU")
        self.calibrations = {name: measurements.calibration(camera) for name, camera in CAMERAS.items()}
        for name, calibration in self.calibrations.items():
            self.perception.calibrate(name, calibration)
        self.facts = RecentFacts()
        self.tracks: Tracks | None = None

    def take_in(self, step: Step) -> None:
        """What comes beside the pictures."""
        self.perception.ego(step.stamp_ns, step.ego)
        if step.sweep is not None:
            self.perception.sweep(step.stamp_ns, step.sweep)
        if step.map is not None:
            self.perception.map(step.stamp_ns, step.map)
        self.facts.take_in(self.front_end.settle(step.stamp_ns, step.ego.speed_mps), step.stamp_ns)

    def look(self, step: Step, look: Look) -> SceneGraph:
        """See a picture; the graph as it is then."""
        seen = self.perception.see(look.camera, step.stamp_ns, look.frame)
        self.tracks = seen.tracks or self.tracks
        sighting = Sighting(
            camera=look.camera,
            stamp_ns=step.stamp_ns,
            boxes=seen.boxes.boxes,
            open_picture=lambda: open_picture(look.frame),
            calibration=self.calibrations[look.camera],
        )
        self.facts.take_in(self.front_end.see(sighting), step.stamp_ns)
        tracks = self.tracks.tracks if self.tracks is not None else ()
        facts = self.facts.at(step.stamp_ns)
        return build(Seen(look.camera, look.frame.frame, seen.boxes.boxes, tracks, facts, step.ego))


def graphs(steps: Sequence[Step]) -> Iterator[Graphs]:
    """Our graph and the true one, once a second of the front camera."""
    eyes, due_ns = Eyes(), steps[0].stamp_ns + EVERY_NS
    for step in steps:
        eyes.take_in(step)
        for look in step.looks:
            graph = eyes.look(step, look)
            if look.camera == FRONT and step.stamp_ns >= due_ns:
                due_ns += EVERY_NS
                yield graph, true_graph(step, look)


def answered(name: str, pairs: Sequence[Graphs]) -> tuple[dict[str, object], list[Answered]]:
    """The reference in DriveLM's form, and our answers to its questions."""
    frames = {str(true.frame): _known(true) for _, true in pairs}
    reference = to_drivelm({name: Scene("", frames)})
    ours = {str(true.frame): graph for graph, true in pairs}
    return reference, [
        _answer(f"{name}_{row.place.frame}_{row.number}", row.place.question, ours[row.place.frame])
        for row in rows(reference)
    ]


def _known(graph: SceneGraph) -> SceneGraph:
    """Without the questions that this graph itself leaves open."""
    return msgspec.structs.replace(graph, qa=tuple(qa for qa in graph.qa if qa.score > 0))


def _answer(number: str, question: str, graph: SceneGraph) -> Answered:
    asked, found = recognise(question), ask(graph, question)
    return Answered(number, question, asked.family if asked else "", found.text if found.score > 0 else "")


def main(arguments: Sequence[str]) -> int:
    """Drive, ask, score. Exit status: 0 measured, 2 something is missing."""
    parser = argparse.ArgumentParser(prog="python -m studies gvqa.drive", description=__doc__)
    parser.add_argument("folder", type=Path)
    parser.add_argument("--scenario", default="urb-rain")
    parser.add_argument("--seed", type=int, default=7)
    parser.add_argument("--seconds", type=float, default=30.0)
    add_json(parser)
    flags = parser.parse_args(arguments)
    try:
        steps = record(DriveName(scenario=flags.scenario, seed=flags.seed, seconds=flags.seconds))
    except (UserError, OSError, RendererUnavailable) as error:
        sys.stderr.write(f"studies.gvqa.drive: {error}\n")
        return 2
    reference, ours = answered(flags.scenario, list(graphs(steps)))
    flags.folder.mkdir(parents=True, exist_ok=True)
    (flags.folder / "reference.json").write_bytes(msgspec.json.format(msgspec.json.encode(reference)))
    (flags.folder / "answers.json").write_bytes(as_challenge(ours))
    scores = report(*pair(msgspec.json.decode(as_challenge(ours)), rows(reference)))
    show([sheet(ours), scores_sheet(str(flags.folder / "answers.json"), scores)], as_json=flags.json)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
