"""Euro NCAP's sheet of speed assistance (2026), scored by its own package, `euroncap-rating-2026` (Apache-2.0).

The sheet takes PASS or FAIL for each line. The bounds of accuracy are in the protocol, not in the package: here they are the goals
of this table, 99 % by distance and 98 % by change. The warning tests stand for the general requirements. Local hazards, updates of a
map and speed control are not offered, and score nothing.
"""

import io
import logging
from collections.abc import Iterator, Mapping
from typing import Any

MISSING = "not scored: pip install 'drivemcp-evaluation[ncap]'"
BY_DISTANCE, BY_EVENT = 0.99, 0.98
GENERAL, DISTANCE, EVENT = "SLIF - General requirements", "Distance based KPI", "Event based KPI"
PARTS: Mapping[str, float] = {
    "accuracy": 4.0,
    "advanced limits": 3.0,
    "local hazards": 3.0,
    "updates": 2.0,
    "control": 8.0,
}
"""Points of each part."""


def lines(
    right_share: float, changes_share: float, tests_passed: bool, capabilities: Mapping[str, bool]
) -> dict[str, bool]:
    """What passes, by the sheet's names; what is not named fails."""
    return {
        GENERAL: tests_passed, DISTANCE: right_share >= BY_DISTANCE, EVENT: changes_share >= BY_EVENT, **capabilities,
    }  # fmt: skip


def points(passed: Mapping[str, bool]) -> dict[str, float] | None:
    """Points of each part by the package; None: it is not installed."""
    try:
        import pandas as pd
        from euroncap_rating_2026.safe_driving import speed_assistance as ncap
    except ImportError:
        return None
    logging.getLogger("euroncap_rating_2026").setLevel(logging.ERROR)
    profile = ncap.get_profile()
    verified = pd.read_csv(io.StringIO(profile.verification_csv), sep=";")
    speedometer = verified["Scenario"] == "Speedometer accuracy"
    named = verified["Scenario"].where(verified["Scenario"].notna(), verified["Category"])
    verified["Value"] = named.map(lambda name: "PASS" if passed.get(name, False) else "FAIL").where(
        ~speedometer, verified["Value"]
    )
    scores = pd.DataFrame({"Category": ["SLIF - System updates"], "Scenario": ["N/A"], "Score": [0.0]})
    dfs = {
        "VA - Speed assist. pred.": _nothing_predicted(pd, ncap, profile), "VA - Speed assist. verif.": verified,
        "Scenario Scores": scores,
    }  # fmt: skip
    _, scores, found, _ = ncap.compute_score(dfs)
    return {
        "accuracy": found["Distance based"] + found["Event based"],
        "advanced limits": sum(found[name] for name in profile.advanced_scenarios),
        "local hazards": sum(
            points for name, points in found.items() if name in ncap.SLIF_LOCAL_HAZARD_VERIFICATION_ROWS
        ),
        "updates": float(scores["Score"].iloc[0]),
        "control": found["Intelligent speed limiter"] + found["Intelligent adaptive cruise control"],
    }


def _nothing_predicted(pd: Any, ncap: Any, profile: Any) -> Any:
    """The sheet of predictions, with local hazards that are sent and received by nothing."""
    head = ["", "", *ncap.LOCAL_HAZARD_COLUMNS]
    empty = [["N/A"] * len(head)] * profile.hazard_table_start_row
    return pd.DataFrame([*empty, head, *([["Red"] * len(head)] * 6)])


def rows(passed: Mapping[str, bool]) -> Iterator[tuple[str, str, str]]:
    """A line for each part, and the sum; what, the points, the goal."""
    found = points(passed)
    for part, most in PARTS.items():
        value = MISSING if found is None else f"{found[part]:.2g}"
        yield f"Euro NCAP, {part}, of {most:g} points", value, "3" if part == "advanced limits" else ""
    total = MISSING if found is None else f"{sum(found.values()):.3g}"
    yield f"Euro NCAP, speed assistance, of {sum(PARTS.values()):g} points", total, ""
