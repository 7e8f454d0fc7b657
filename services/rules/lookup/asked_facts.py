"""What a question in plain words says of vehicle, driver and weather, so that no limit for another case answers it."""

import re
from typing import Any

_CLASSES: tuple[tuple[str, str], ...] = (
    (
        "car_trailer",
        r"trailers?|caravans?|tow(?:ing|s|ed)?|horse ?box|\w*anhänger\w*|wohnw[aä]gen|gespann\w*|remorques?|caravanes?|attelage|"
        r"\w*aanhang\w*|przyczep\w*|rimorchi\w*|roulotte|remolques?|caravanas?",
    ),
    (
        "lorry",
        r"lorr(?:y|ies)|trucks?|hgvs?|artics?|semis?|tonners?|lkw\w*|laster\w*|lastw[aä]gen|lastkraftw\w*|sattel\w*|\w+tonner\w*|"
        r"poids[ -]lourds?|camions?|semi-remorques?|vrachtw\w*|vrachtauto\w*|ciężar\w*|tir(?:y|em)?|autocarr\w*|camiones|"
        r"\d+(?:[.,]\d)? ?(?:t|tonnes?|tons?|tonnen)",
    ),
    ("coach", r"coach(?:es)?|reise(?:bus\w*|cars?)|autocars?|touringcars?|autokar\w*|autocares"),
    ("bus", r"bus(?:es|se|sen)?|omnibus\w*|autobus\w*"),
    (
        "van",
        r"vans?|transits?|sprinters?|ducatos?|crafters?|kangoos?|berlingos?|vitos?|vivaros?|trafics?|lutons?|transporters?|lieferw[aä]gen|kastenw[aä]gen|kleintransporter|"
        r"camionnettes?|fourgon(?:nette)?s?|utilitaires?|bestel(?:bus\w*|wagen\w*|auto\w*)|dostawcz\w*|furgon\w*|furgonetas?",
    ),
    ("motorcycle", r"motor(?:cycle|bike)s?|motorr[aä]d\w*|motos?|motor(?:fiets\w*|rijder\w*)|motocykl\w*|motocicl\w*"),
)
_FACTS: tuple[tuple[str, Any, str], ...] = (
    (
        "novice",
        True,
        r"novices?|probation\w*|learner\w*|provisional licen[cs]e|p[- ]plates?|new drivers?|"
        r"(?:passed|got) (?:my|his|her|their|the) (?:driving )?(?:test|licen[cs]e)|"
        r"passed (?:last|this) \w+|licen[cs]e (?:for|since|only)|führerschein (?:seit|erst|gerade)|permis (?:depuis|en poche)|"
        r"fahranfänger\w*|probezeit|führerschein auf probe|neulenker\w*|permis probatoire|jeunes? (?:conducteur|permis)\w*|"
        r"apprenti\w*|(?:d'avoir|obtenu|eu|passé|décroché) (?:le|mon|son|leur) permis|"
        r"beginnende bestuurder\w*|młod\w+ kierow\w*|neopatentat\w*|noveles?",
    ),
    (
        "snow_chains",
        True,
        r"(?:snow |tyre |tire )?chains|\w*schneeketten?|chaînes|sneeuwkettingen|łańcuch\w*|catene|cadenas",
    ),
    (
        "wet",
        True,
        r"rain\w*|wet|regen\w*|regne\w*|nass\w*|nässe|pluie|pleut|mouillée?s?|nat(?:te)?|deszcz\w*|mokr\w*|piogg\w*|bagnat\w*|lluvia|mojad\w*",
    ),
    ("snow", True, r"snow(?:s|ing|y)?|schnee|schneit|neige\w*|sneeuw\w*|śnieg\w*|neve|nevica|nieve"),
    (
        "visibility_m",
        40.0,
        r"fog\w*|mist\w*|nebel\w*|neblig\w*|brouillard|mgł\w*|nebbia|niebla|visibility|sichtweite|visibilité",
    ),
    ("lit", True, r"lamp ?posts?|street ?(?:lights?|lamps?)|lit|laternen|lampadaires?|éclairée?s?"),
)
_PATTERNS = [
    (field, value, re.compile(rf"\b(?:{words})\b", re.I))
    for field, value, words in (*(("vehicle_class", *each) for each in _CLASSES), *_FACTS)
]


def asked_facts(query: str) -> dict[str, Any]:
    """Fields of `Situation` that the question states; of several classes of vehicle the first of the list."""
    found: dict[str, Any] = {}
    for field, value, pattern in _PATTERNS:
        if field not in found and pattern.search(query):
            found[field] = value
    return found
