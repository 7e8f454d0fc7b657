"""What the page says, in words: one story a message, and the counts of the drive."""

import base64
from collections import Counter
from collections.abc import Iterator, Sequence
from datetime import UTC, datetime

import msgspec

from app.pictures import unpacked
from app.replay.again import AtHand, UnknownProfile
from app.report.drive_log import DriveLog, Spoken
from app.report.ticks import Citation, Tick
from app.report.timeline import FACTORS
from drivemcp.errors import MALFORMED
from drivemcp.pictures import draw_boxes, packed
from proto.decision import TraceRecord
from services.arbiter.decide import Inputs
from services.arbiter.explain import Flip, smallest_flips

WIDEST_PX, QUALITY = 640, 68
SEEN_MOST = 5


class Story(msgspec.Struct, frozen=True, kw_only=True):
    """One message to the driver and all that it rests on."""

    number: int
    tick: int
    at: str
    urgent: bool
    kind: str
    directive: str
    language: str
    justification: str
    picture: str
    """A JPEG in base64; empty: the log has none."""
    seen: tuple[str, ...]
    law: tuple[Citation, ...]
    weather: str
    car: str
    events: tuple[str, ...]
    numbers: tuple[tuple[str, str], ...]
    decided: str
    withheld: str
    otherwise: tuple[str, ...]
    """The smallest changes with which it would have been decided otherwise."""
    late: tuple[str, ...]
    replay: str


def stories(log: DriveLog, at_hand: AtHand) -> tuple[Story, ...]:
    """Every message, in the order in which they were told."""
    begin_ns = log.ticks[0].stamp_ns if log.ticks else 0
    named = " ".join(str(path) for path in log.files)
    return tuple(_story(number, spoken, begin_ns, named, at_hand) for number, spoken in enumerate(log.spoken, start=1))


def _story(number: int, spoken: Spoken, begin_ns: int, files: str, at_hand: AtHand) -> Story:
    tick, said = spoken.tick, spoken.tick.advisory
    return Story(
        number=number,
        tick=tick.tick,
        at=clock((tick.stamp_ns - begin_ns) / 1e9),
        urgent=said.urgency in ("warning", "alarm") or said.kind == "ACT",
        kind=f"{said.kind}, {said.urgency}" if said.urgency else said.kind,
        directive=said.directive,
        language=said.language,
        justification=said.justification,
        picture=picture_of(spoken),
        seen=tuple(_seen(tick)),
        law=_law(tick),
        weather=_message(tick, "conditions", "reason"),
        car=_car(tick),
        events=tuple(f"{each.kind.replace('_', ' ')} {each.g:.2f} (from {each.eta:.2f} on)" for each in tick.events),
        numbers=tuple(_numbers(tick)),
        decided=tick.decision.reason,
        withheld=tick.decision.act_withheld,
        otherwise=tuple(_otherwise(spoken, at_hand)),
        late=said.late_tools,
        replay=f"drivemcp replay {files} --tick {tick.tick}",
    )


def picture_of(spoken: Spoken) -> str:
    """The picture that was decided on, with the boxes, as a JPEG in base64; empty without a readable picture."""
    pixels = unpacked(spoken.jpeg) if spoken.jpeg else None
    if pixels is None:
        return ""
    drawn = pixels.copy()
    draw_boxes(drawn, spoken.boxes)
    return base64.b64encode(packed(drawn, widest_px=WIDEST_PX, quality=QUALITY)).decode()


def clock(seconds: float) -> str:
    """Minutes and seconds since the first tick."""
    return f"{int(seconds) // 60}:{seconds % 60:04.1f}"


def _seen(tick: Tick) -> Iterator[str]:
    """The road users ahead in the path, the nearest first, and the signs that the world state holds."""
    tracks = tick.inputs.tracks.message.get("tracks", ()) if tick.inputs.tracks is not None else ()
    ahead = sorted((each for each in tracks if each.get("in_ego_path")), key=lambda each: float(each.get("x_m", 0.0)))
    for each in ahead[:SEEN_MOST]:
        yield (
            f"{each.get('kind', 'road user')} {each.get('x_m', 0.0):.0f} m ahead in the path, "
            f"{_closing(-float(each.get('vx_mps', 0.0)))}, confidence {each.get('confidence', 0.0):.2f}"
        )
    environment = tick.world.get("environment") or {}
    for told in (environment.get("signs") or ())[:SEEN_MOST]:
        sign = told.get("value") or {}
        place = sign.get("distance_m")
        where = f", {place:.0f} m ahead" if isinstance(place, int | float) else ""
        doubt = "" if sign.get("believed") else ", not yet believed"
        face = str(sign.get("reading", "?"))[:40].replace("_", " ").replace(":", " ")
        yield f"sign {face}{where}, confidence {told.get('confidence', 0.0):.2f}{doubt}"


def _closing(mps: float) -> str:
    return "gap steady" if abs(mps) < 0.5 else f"gap {'closing' if mps > 0 else 'opening'} at {abs(mps):.1f} m/s"


def _law(tick: Tick) -> tuple[Citation, ...]:
    cited = [*tick.fused.citations, *(each for reason in tick.fused.reasons for each in reason.citations)]
    return tuple({(each.document, each.start, each.section): each for each in cited}.values())


def _message(tick: Tick, name: str, field: str) -> str:
    told = getattr(tick.inputs, name)
    value = told.message.get(field) if told is not None else None
    return value if isinstance(value, str) else ""


def _car(tick: Tick) -> str:
    told = tick.inputs.degradation
    if told is None:
        return "nothing is known of the car's health"
    h, codes = told.message.get("h"), told.message.get("dtcs") or ()
    lamps = told.message.get("warning_lamps") or ()
    parts = [f"degradation {h:.2f} of 1" if isinstance(h, int | float) else "degradation unknown"]
    parts += [f"codes {', '.join(map(str, codes))}"] if codes else []
    parts += [f"lamps {', '.join(map(str, lamps))}"] if lamps else []
    return "; ".join(parts)


_METRICS = (
    ("gap_m", "gap", "m"), ("closing_mps", "closing speed", "m/s"), ("ttc_s", "time to collision", "s"),
    ("headway_s", "headway", "s"), ("d_min_low_mu_m", "RSS distance, low friction", "m"),
    ("d_min_high_mu_m", "RSS distance, high friction", "m"), ("r", "risk r", ""), ("u_speak", "utility of SPEAK", ""),
    ("u_act", "utility of ACT", ""), ("margin", "margin of ACT", ""), ("delta", "Δ", ""),
)  # fmt: skip


def _numbers(tick: Tick) -> Iterator[tuple[str, str]]:
    said, metrics = tick.advisory, tick.decision.metrics
    factor = FACTORS.get(said.unit, 3.6)
    if tick.speed_mps is not None:
        yield "speed", f"{tick.speed_mps * factor:.0f} {said.unit}"
    if said.legal_limit is not None:
        yield "limit", f"{said.legal_limit.value:g}{'?' if said.legal_limit.assumed else ''} {said.legal_limit.unit}"
    if said.target_mps is not None:
        yield "target", f"{said.target_mps * factor:.0f} {said.unit}"
    yield "confidence", f"{said.confidence:.2f}"
    for name, words, unit in _METRICS:
        value = metrics.get(name)
        if isinstance(value, int | float) and not isinstance(value, bool):
            yield words, f"{value:.3g} {unit}".strip()
    if tick.decision.brake_mps2:
        yield "braked with", f"{tick.decision.brake_mps2:.1f} m/s²"
    if said.snapshot_to_advice_ms is not None:
        yield "picture to advice", f"{said.snapshot_to_advice_ms:.0f} ms"


_BECOMES = {
    "SILENT": "it would have stayed silent", "SPEAK": "it would have spoken alone", "ACT": "it would have braked",
    "SPEAK (ACT withheld)": "it would have braked, had a grant allowed it",
    "ACT (ACT withheld)": "it would have braked, had a grant allowed it",
}  # fmt: skip
MOST_FLIPS = 3


def _otherwise(spoken: Spoken, at_hand: AtHand) -> Iterator[str]:
    """In words; a log of another version, or of a profile that is not at hand, says so."""
    try:
        trace = msgspec.json.decode(spoken.trace, type=TraceRecord)
        if trace.request is None:
            return
        profile = at_hand.of(trace.decision.profile, trace.decision.profile_sha256)
        flips = smallest_flips(trace.request, msgspec.convert(trace.decision.own, Inputs), profile)
    except MALFORMED:
        yield "cannot be reckoned: this version reads no trace of that one"
        return
    except UnknownProfile as error:
        yield f"cannot be reckoned: {error}"
        return
    yield from map(flip_in_words, flips[:MOST_FLIPS])


def flip_in_words(flip: Flip) -> str:
    """One quantity moved alone: `above a distance to the actor of 38 m (12 m then) it would have stayed silent`."""
    side = "above" if flip.to_value > flip.from_value else "below"
    unit = f" {flip.unit}" if flip.unit else ""
    becomes = _BECOMES.get(flip.becomes, f"it would have been {flip.becomes}")
    return f"{side} a {flip.quantity} of {flip.to_value:.3g}{unit} ({flip.from_value:.3g}{unit} then) {becomes}"


class Counts(msgspec.Struct, frozen=True, kw_only=True):
    """The drive in numbers. `began` is empty where the log has no date."""

    began: str
    length: str
    distance: str
    ticks: int
    messages: int
    braked: int
    withheld: int
    degraded_share: str
    latency: str
    unit: str


def counts(log: DriveLog) -> Counts:
    """By what the log holds alone."""
    ticks = log.ticks
    units = Counter(each.advisory.unit for each in ticks)
    unit = units.most_common(1)[0][0] if units else "km/h"
    degraded = sum(bool(each.advisory.degraded) for each in ticks)
    return Counts(
        began=_began(ticks[0].stamp_ns) if ticks else "",
        length=clock(log.seconds),
        distance=f"{log.distance_m / 1609.344:.2f} mi" if unit == "mph" else f"{log.distance_m / 1e3:.2f} km",
        ticks=len(ticks),
        messages=len(log.spoken),
        braked=sum(each.decision.brake_mps2 > 0.0 for each in ticks),
        withheld=sum(bool(each.decision.act_withheld) for each in ticks),
        degraded_share=f"{degraded / len(ticks):.0%}" if ticks else "",
        latency=_median_ms(ticks),
        unit=unit,
    )


def _began(stamp_ns: int) -> str:
    """Date and time; empty where a simulator's own clock, which starts at 0, stamped the drive."""
    began = datetime.fromtimestamp(stamp_ns / 1e9, UTC)
    return f"{began:%Y-%m-%d %H:%M:%S} UTC" if began.year > 1970 else ""


def _median_ms(ticks: Sequence[Tick]) -> str:
    told = sorted(
        each.advisory.snapshot_to_advice_ms for each in ticks if each.advisory.snapshot_to_advice_ms is not None
    )
    return f"{told[len(told) // 2]:.0f} ms" if told else "not measured"


def degraded_by(ticks: Sequence[Tick]) -> list[tuple[str, str]]:
    """What was missing, and in which share of the ticks; the most frequent first."""
    found = Counter(name for each in ticks for name in each.advisory.degraded)
    return [(name, f"{count / len(ticks):.1%} of ticks") for name, count in found.most_common()]


def tools_of(log: DriveLog) -> list[tuple[str, int, str]]:
    """Each tool with its calls, and how many of them failed, by status."""
    names = sorted({tool for tool, _ in log.calls})
    return [(name, sum(n for (tool, _), n in log.calls.items() if tool == name), _failed(log, name)) for name in names]


def _failed(log: DriveLog, name: str) -> str:
    bad = {status: n for (tool, status), n in log.calls.items() if tool == name and status != "ok"}
    return ", ".join(f"{n} {status}" for status, n in sorted(bad.items())) or "0"


def versions_of(ticks: Sequence[Tick]) -> list[tuple[str, str]]:
    """What was in use; where it changed on the way, all of it."""
    found: dict[str, dict[str, None]] = {}
    for tick in ticks:
        for name, value in tick.versions.items():
            found.setdefault(name, {})[value] = None
    return [(name, ", ".join(values)) for name, values in sorted(found.items())]


def settings_of(log: DriveLog) -> list[tuple[str, str]]:
    """What each service was given that is not its default, as it said itself."""
    return [(name, told) for name, health in sorted(log.health.items()) if (told := health.detail.get("settings", ""))]
