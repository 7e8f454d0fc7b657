"""Where the paper's tables cannot follow from its own definitions: worked out from its numbers, nothing of ours."""

from collections.abc import Iterator

from evaluation.campaign.plan import FAMILIES
from evaluation.tables.paper import paper, paper_rows

PAPER_RUNS = 10


def contradictions() -> tuple[str, ...]:
    """One sentence or two each."""
    return tuple(_contradictions())


def _contradictions() -> Iterator[str]:
    yield from (_act_unreachable(), _false_positives(), _two_numbers(), _no_feedback(), _slower(), _distance())


def _act_unreachable() -> str:
    c = paper()["arbiter_constants"]
    slope = 1.0 - c["b_adv"]
    best = slope - (c["c_act"] + c["c_err"] - c["c_fat"])
    acts = ", ".join(f"{row['interventions_per_10km']:g}" for row in paper_rows("delta").values())
    return (
        f"Interventions. With the printed constants U_act - U_speak is {slope:g} r - {c['c_act'] + c['c_err'] - c['c_fat']:g}, "
        f"at most {best:.2f} for r = 1, and ACT takes more than Delta (0 to 0.4). No intervention can happen; the Delta table "
        f"has {acts} per 10 km. Our profile `paper` never acts; the rows here are made with the calibrated one."
    )


def _false_positives() -> str:
    shares = ", ".join(f"{row['false_positive_pct']:g}" for row in paper_rows("delta").values())
    return (
        f"False positives. The paper's ACT needs an RSS violation, and its false positive is an intervention without one: "
        f"the share is 0 by definition, and the table has {shares} %. We count an intervention as false where the simulator's "
        "truth, not the system's own estimate, shows no violation."
    )


def _two_numbers() -> str:
    delta = paper()["arbiter_constants"]["delta"]
    one = paper_rows("delta")[f"{delta:g}"]["ttc_at_escalation_s"]
    other = paper_rows("results")[f"{FAMILIES['dynamic-vsl']}/DriveMCP"]["ttc_at_escalation_s"]
    return (
        f"One configuration, two numbers. DriveMCP in DYNAMIC-VSL at Delta = {delta:g}, all else fixed, has a TTC at escalation of "
        f"{other:g} s in the results table and {one:g} s in the Delta table. Here "
        "the same settings come out alike in the same places; a row with more places has another mean."
    )


def _no_feedback() -> str:
    rows = paper_rows("ablation")
    return (
        "Feedback. All parameters are fixed during the paper's evaluation, so that taking adaptation away changes nothing; the "
        f"ablation table has {rows['no_feedback_adaptation']['infractions_per_10km']:g} against "
        f"{rows['full']['infractions_per_10km']:g} infractions per 10 km. Here that row can differ only where labels are given. "
        "The row of feedback over the runs has them, scripted from how its drives came out, and cannot differ before the first."
    )


def _slower() -> str:
    rows = paper_rows("results")
    pairs = "; ".join(
        f"{rows[f'{name}/DriveMCP']['hazard_response_s']:g} against {rows[f'{name}/VLM-Tools-NoArbiter']['hazard_response_s']:g} s"
        for name in FAMILIES.values()
    )
    return (
        "Hazard response. The paper concludes that DriveMCP responds faster than all three baselines; in its table it is slower than "
        f"VLM-Tools-NoArbiter in every family ({pairs}), and escalates at a lower TTC."
    )


def _distance() -> str:
    needed = [
        (f"{row['infractions_per_10km']:g} +- {row['infractions_sd']:g}", 10 * row["infractions_per_10km"] / row["infractions_sd"] ** 2)
        for row in paper_rows("results").values()
    ]  # fmt: skip
    text, km = max(needed, key=lambda pair: pair[1])
    return (
        "Distance. The paper tells none. Infractions are counts: even if nothing but chance spreads them, a rate L per 10 km has a "
        f"standard deviation over runs of at least sqrt(L/(d/10 km)). For the printed {text} every one of its {PAPER_RUNS} runs was "
        f"{km:.0f} km or longer, or the spread is not one of counted infractions."
    )
