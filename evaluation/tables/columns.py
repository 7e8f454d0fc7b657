"""What stands in a table's columns: which metric, how runs come together, and where the paper has the same number."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Literal

import msgspec

from evaluation.campaign.names import TableName
from evaluation.metrics.precision import TOPICS
from services.simulator.truth.hazard_words import WORDS


class Column(msgspec.Struct, frozen=True, kw_only=True):
    """One column: a `rate` of evaluation.metrics.RATES, a `field` of its Metrics, or a `share` of two counts in %.

    A name with a dot in it is a field by kind, and the kind: `hazards_by_kind.pedestrian`.
    """

    title: str
    unit: str = ""
    better: Literal["less", "more", ""] = "less"
    rate: str = ""
    field: str = ""
    """Of a list, each run's `of`."""
    of: Literal["mean", "median"] = "mean"
    share: tuple[str, str] = ("", "")
    scale: float = 1.0
    """From the field's unit to the column's."""
    paper: str = ""
    """Column of the paper's table; empty: it has none."""
    paper_spread: str = ""
    """Its column with the standard deviation or the half interval."""
    places: int = 2
    most: float = math.inf
    """What it cannot exceed."""

    @property
    def least(self) -> float:
        """What is less than this apart reads the same."""
        return 0.5 * 10.0**-self.places


INFRACTIONS = Column(
    title="infractions", unit="/10 km", rate="infractions", paper="infractions_per_10km", paper_spread="infractions_sd"
)
OVERSPEED = Column(title="overspeed", unit="%", field="overspeed_inferred_pct", paper="overspeed_pct")
RESPONSE = Column(title="hazard response", unit="s", field="hazard_response_s", paper="hazard_response_s")
LATENCY = Column(
    title="advisory latency", unit="s", field="advisory_latency_s", paper="advisory_latency_s", places=3,
)  # fmt: skip
TTC = Column(title="TTC at escalation", unit="s", better="more", field="ttc_escalation_s", paper="ttc_at_escalation_s")
F1 = Column(
    title="event F1", unit="%", better="more", field="event_f1", scale=100, most=100, paper="event_f1_pct", places=1
)
TOOLS = Column(
    title="correct tools", unit="%", better="more", field="correct_tool_rate", scale=100, most=100, paper="correct_tool_pct", places=1
)  # fmt: skip
ACTS = Column(title="interventions", unit="/10 km", better="", rate="interventions", paper="interventions_per_10km")
FALSE = Column(
    title="false interventions", unit="%", share=("false_interventions", "interventions"), paper="false_positive_pct", places=1
)  # fmt: skip
TARGET = Column(title="target speed", unit="km/h", field="target_mean_mps", scale=3.6, paper="target_kph", places=1)
NEAR = Column(title="near-collisions", unit="/10 km", rate="near_collisions", paper="near_collisions_per_10km")

COLUMNS: Mapping[TableName, tuple[Column, ...]] = MappingProxyType(
    {
        "results": (INFRACTIONS, OVERSPEED, RESPONSE, LATENCY, TTC),
        "proposer": (INFRACTIONS, OVERSPEED, RESPONSE, LATENCY, TTC),
        "corruption": (F1, TOOLS, INFRACTIONS, OVERSPEED, RESPONSE),
        "delta": (ACTS, FALSE, TTC),
        "ablation": (
            msgspec.structs.replace(INFRACTIONS, paper_spread="infractions_ci95"),
            msgspec.structs.replace(LATENCY, paper_spread="latency_ci95"),
            RESPONSE,
        ),
        "can-fault": (TARGET, msgspec.structs.replace(TTC, paper="ttc_s"), NEAR),
    }
)
"""The paper's columns of each table."""

NAGS = Column(title="nags", unit="/10 km", rate="nags")
COLLISIONS = Column(title="collisions", unit="/1,000 km", rate="collisions")
LATENCY_P50 = Column(title="advisory latency p50", unit="s", field="advisory_latency_s", of="median", places=3)
UNTOLD = Column(title="infractions told late, wrongly or not at all", unit="/10 km", rate="infractions_untold")
TARGET_ABOVE = Column(title="target above the true limit", unit="s/h", rate="target_above_law", places=0)
CONTACT = Column(title="speed at contact", unit="km/h", field="contact_speed_mps", scale=3.6, places=0)
OURS: tuple[Column, ...] = (
    UNTOLD,
    Column(title="overspeed, true limit", unit="%", field="overspeed_true_pct"),
    Column(title="hazards answered", unit="%", better="more", share=("hazards_answered", "hazards"), places=0),
    Column(
        title="hazards met well without a word", unit="%", better="", share=("hazards_met_untold", "hazards"), places=0
    ),
    Column(
        title="hazards answered before the onset",
        unit="%",
        better="",
        share=("hazards_answered_before", "hazards"),
        places=0,
    ),
    LATENCY_P50,
    # In lockstep a picture is understood in the step in which it is taken: what is left is from the snapshot on.
    Column(title="snapshot to advice p50", unit="s", field="sensor_latency_p50_s", places=3),
    Column(title="snapshot to advice p99", unit="s", field="sensor_latency_p99_s", places=3),
    F1,
    msgspec.structs.replace(F1, title="event F1 without overspeed", field="event_f1_without_law", paper=""),
    TOOLS,
    ACTS,
    FALSE,
    Column(title="false interventions", unit="/1,000 km", rate="false_interventions", places=1),
    Column(
        title="of false interventions, while a hazard is on",
        unit="%",
        better="",
        share=("false_while_hazard", "false_interventions"),
        places=0,
    ),
    Column(title="RSS violations", unit="/10 km", rate="rss_violations"),
    Column(title="RSS violations unanswered", unit="/10 km", rate="rss_unanswered"),
    Column(title="TTC at intervention", unit="s", better="more", field="ttc_intervention_s"),
    Column(title="headway, median", unit="s", better="more", field="headway_median_s"),
    Column(title="headway below 1 s", unit="%", field="headway_short_share", scale=100, places=1),
    NEAR,
    COLLISIONS,
    Column(title="messages", unit="/10 km", better="", rate="messages", places=1),
    Column(title="messages", unit="/h", rate="messages_hour", places=0),
    Column(title="listening", unit="s/h", rate="listening", places=0),
    Column(title="messages cut off", unit="/10 km", rate="cut_off"),
    NAGS,
    Column(title="repeats within 20 s", unit="/10 km", rate="repeats_20s"),
    Column(title="false warnings", unit="/10 km", rate="false_warnings"),
    Column(title="wrong limit", unit="s/h", rate="wrong_limit", places=0),
    Column(title="unknown limit", unit="s/h", rate="unknown_limit", places=0),
    Column(title="unnecessary slow-downs", unit="/10 km", rate="unnecessary_slow_downs"),
    Column(title="hardest braking", unit="m/s²", field="hardest_braking_mps2"),
    Column(title="hard brakings", unit="/10 km", rate="hard_brakings"),
    Column(title="jerk, rms", unit="m/s³", field="jerk_rms_mps3"),
)
"""What we measure beside."""


def _of_hazards(kind: str) -> tuple[Column, Column]:
    """Of one kind of hazards: the response, and how many were answered."""
    shares, name = (f"hazards_answered_by_kind.{kind}", f"hazards_by_kind.{kind}"), kind.replace("_", " ")
    return (
        Column(title=f"hazard response, {name}", unit="s", field=f"hazard_response_by_kind_s.{kind}"),
        Column(title=f"hazards answered, {name}", unit="%", better="more", share=shares, places=0),
    )


def _of_messages(topic: str) -> tuple[Column, Column]:
    """Of one topic: how many messages were true, and how many needed."""
    judged, name = f"messages_judged_by_topic.{topic}", topic.replace("_", " ")
    return (
        Column(
            title=f"messages true, {name}",
            unit="%",
            better="more",
            share=(f"messages_true_by_topic.{topic}", judged),
            places=0,
        ),
        Column(
            title=f"messages needed, {name}",
            unit="%",
            better="more",
            share=(f"messages_needed_by_topic.{topic}", judged),
            places=0,
        ),
    )


_KINDS = (
    *(column for kind in WORDS for column in _of_hazards(kind)),
    *(column for topic in TOPICS for column in _of_messages(topic)),
)
OURS_OF: Mapping[TableName, tuple[Column, ...]] = MappingProxyType(
    {
        "results": _KINDS,
        "proposer": (TARGET_ABOVE, CONTACT, *_KINDS),
        "corruption": (Column(title="signs corrupted", unit="%", better="", share=("signs_corrupted", "signs_drawn"), places=0),),
    }
)  # fmt: skip
"""Of one table alone: hazards kind by kind; what became of a rate by chance, over as many signs as were met."""


def columns_of(table: TableName) -> tuple[Column, ...]:
    """The paper's columns, then ours that are not among them, then ours of that table alone."""
    paper = COLUMNS[table]
    told = {(column.title, column.unit) for column in paper}
    return (*paper, *(column for column in OURS if (column.title, column.unit) not in told), *OURS_OF.get(table, ()))
