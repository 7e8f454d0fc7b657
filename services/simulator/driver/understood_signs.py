"""Which signs the driver of a scenario understands by himself, by the language he reads and the country he comes from."""

from services.simulator.scenario.law import Post
from services.simulator.scenario.plan import Scenario

_WORDS = {f"plate:when_wet:{language}": language for language in ("de", "en", "fr", "nl", "pl")}
_FOREIGN_TO_BRITAIN = frozenset({"town_entry", "town_exit", "all_end", "limit_end"})
_FOREIGN_TO_OTHERS = frozenset({"national"})


def understands(scenario: Scenario, post: Post) -> bool:
    """Whether he knows what the post wants of him; a plate that he cannot read makes the whole post unclear."""
    return all(_known(scenario, post, code) for code in post.codes)


def _known(scenario: Scenario, post: Post, code: str) -> bool:
    if code in _WORDS:
        return scenario.driver_language == _WORDS[code]
    word = code.partition(":")[0]
    if scenario.driver_country == "GBR":
        return word not in _FOREIGN_TO_BRITAIN
    # Numbers in miles per hour mean nothing to him; he would drive on as before.
    miles = post.country == "GBR" and word in ("limit", "zone", "led")
    return not miles and word not in _FOREIGN_TO_OTHERS
