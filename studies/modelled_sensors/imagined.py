"""What the model says of the truth of a recording: the same instants as were rendered, without a bus."""

from evaluation.modelled_sensors.boxes import Eye
from evaluation.modelled_sensors.card import Card
from evaluation.modelled_sensors.hosted import Blind
from evaluation.modelled_sensors.reads import ModelledFrontEnd
from proto.perception import Boxes
from proto.scene import Fact, Facts
from proto.vehicle import Ego
from services.drivelm.front_end import Sighting
from services.perception.pipeline import Perception
from studies.modelled_sensors.recording import Recording

SETTLE_NS = 100_000_000


def imagine(recording: Recording, card: Card, seed: int) -> Recording:
    """Boxes, tracks and facts drawn for every picture that the recording has boxes of. There is no map."""
    told = Recording(spec=recording.spec, truths=recording.truths)
    eyes = {name: Eye(card, name, seed) for name in ("front", "tele")}
    pipeline, end = Perception(Blind()), ModelledFrontEnd(card, seed, home="DEU", max_reads=8)
    for name, eye in eyes.items():
        pipeline.calibrate(name, eye.calibration)
    pictures: dict[int, list[Boxes]] = {}
    for stamp_ns, boxes in recording.boxes:
        pictures.setdefault(stamp_ns, []).append(boxes)

    def say(facts: tuple[Fact, ...], stamp_ns: int) -> None:
        if facts:
            told.facts.append((stamp_ns, Facts(facts=facts)))

    for stamp_ns, truth in recording.truths:
        pipeline.ego(stamp_ns, Ego(speed_mps=truth.speed_mps))
        for boxes in pictures.get(stamp_ns, ()):
            name = boxes.camera
            end.know(truth, stamp_ns)
            seen = eyes[name].understood(pipeline, truth, stamp_ns, boxes.frame)
            told.boxes.append((stamp_ns, seen.boxes))
            if seen.tracks is not None:
                told.tracks.append((stamp_ns, seen.tracks))
            sighting = Sighting(
                camera=name,
                stamp_ns=stamp_ns,
                boxes=seen.boxes.boxes,
                open_picture=lambda: None,
                calibration=eyes[name].calibration,
            )
            say(end.see(sighting), stamp_ns)
        if stamp_ns % SETTLE_NS == 0:
            say(end.settle(stamp_ns, truth.speed_mps), stamp_ns)
    return told
