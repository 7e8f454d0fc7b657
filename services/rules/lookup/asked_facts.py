"""What a question in plain words says of road, vehicle, driver and weather, so that no limit for another case answers it."""

import re
from collections.abc import Iterator
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
        r"\d+(?:[.,]\d)? ?(?:t|tonnes?|tons?|tonnen)|(?:[3-9]|\d\d)[ .,]?\d{3} ?kg",
    ),
    ("coach", r"coach(?:es)?|reise(?:bus\w*|cars?)|autocars?|touringcars?|autokar\w*|autocares"),
    ("bus", r"bus(?:es|se|sen)?|omnibus\w*|autobus\w*"),
    (
        "van",
        r"vans?|transits?|sprinters?|ducatos?|crafters?|kangoos?|berlingos?|vitos?|vivaros?|trafics?|lutons?|transporters?|"
        r"lieferw[aä]gen|kastenw[aä]gen|kleintransporter|"
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
    (
        "standing",
        True,
        r"standing (?:passengers|room|people)|passengers (?:who )?stand\w*|stehende\w* (?:fahrgäste|passagiere)\w*|stehpl[aä]tz\w*|"
        r"passagers debout|voyageurs debout|staande passagiers|stojąc\w* pasażer\w*|passeggeri in piedi|(?:viajeros|pasajeros) de pie",
    ),
    ("lit", True, r"lamp ?posts?|street ?(?:lights?|lamps?)|lit|laternen|lampadaires?|éclairée?s?"),
)
_ROADS: tuple[tuple[str, str], ...] = (
    (
        "rural",
        r"outside (?:of )?(?:a |the |any )?(?:built[- ]?up|town|city|cities|village|urban|residen|business)\w*|out of town|"
        r"country roads?|single carriageways?|open road|rural roads?|"
        r"au(?:ß|ss)erorts|"
        r"au(?:ß|ss)erhalb (?:von |der |des |einer |geschlossener |geschlossenen )*(?:ortschaft|ortsgebiet|stadt|städt|ort)\w*|"
        r"landstra(?:ß|ss)en?|freiland\w*|überland\w*|"
        r"hors (?:des? |les |d'|d’|une |la )*(?:agglom|ville|village)\w*|"
        r"routes? (?:départementale|nationale|secondaire|de campagne)s?|rase campagne|"
        r"buiten (?:de |een |het )?(?:bebouwde|stad|steden|dorp)\w*|buitenweg\w*|provinciale weg\w*|"
        r"poza (?:obszar\w* |teren\w* )?(?:zabudow|miast)\w*|"
        r"fuori (?:dei |dai |del |dal |dalla |di |da )?(?:centr\w*|città)|extraurban\w*|"
        r"fuera de (?:la |las |los |el )?(?:poblad|ciudad|poblaci|casco)\w*|carreteras? convencional(?:es)?|interurban\w*",
    ),
    (
        "urban",
        r"in (?:a |the )?(?:town|city|village|built[- ]?up area|urban area)s?|residential (?:areas?|streets?|districts?)|"
        r"innerorts|"
        r"(?:in|innerhalb) (?:von |der |des |einer |geschlossener |geschlossenen )*(?:ortschaft|ortsgebiet|stadt)\w*|im ort(?:sgebiet)?|"
        r"en (?:agglom\w*|ville|zone urbaine)|dans les agglom\w*|(?:binnen|in) de (?:bebouwde kom|stad)|"
        r"w (?:obszarze|terenie) zabudowanym|na terenie zabudowanym|w mieście|(?:nei|nel|in) (?:centr[oi] abitat[oi]|città)|"
        r"en (?:poblado|la ciudad|ciudad|casco urbano|vías urbanas)",
    ),
    (
        "motorway",
        r"motorways?|autobahn(?:en)?|autoroutes?|(?:auto)?snelweg(?:en)?|autostrad\w+|autopistas?|freeways?|interstates?",
    ),
)
_NOT = re.compile(
    r"(?:\boff|\bnot on|\bhors|\babseits|au(?:ß|ss)erhalb|\bbuiten|\bpoza|\bfuori|\bfuera)(?: \w+)? ?(?:d'|d’|dall')?$",
    re.I,
)
"""Before the name of a road: any but that one."""
_ROAD_PATTERNS = [(road, re.compile(rf"\b(?:{words})\b", re.I)) for road, words in _ROADS]
_LIGHTS: tuple[tuple[str, str], ...] = (
    (
        "amber_flashing",
        r"(?:flash|blink)\w*[ -]+(?:yellow|amber|gelb)\w*|(?:yellow|amber|orange|gelb\w*|geel|gele)[ -]+(?:flash|blink|clignot|"
        r"knipper|lampegg)\w*|gelbblink\w*|"
        r"(?:feu|orange|jaune)\w*[ -]+(?:orange |jaune )?clignot\w*|(?:oranje|geel|gele) knipper\w*|knipper\w* (?:oranje|geel)|"
        r"(?:żółt\w*|pomarańczow\w*) (?:\w+ )?(?:migaj|pulsuj)\w*|(?:migaj|pulsuj)\w* (?:\w+ )?(?:żółt|pomarańczow)\w*|"
        r"(?:giall\w*|arancion\w*) (?:\w+ )?lampegg\w*|lampegg\w* (?:giall|arancion)\w*|"
        r"(?:ámbar|amarill\w*) (?:\w+ )?(?:intermitente|parpade\w*)|intermitente (?:ámbar|amarill\w*)",
    ),
    (
        "red",
        r"(?:on|at|through) (?:a )?red(?: light)?|red (?:light|traffic light|signal)s?|(?:bei|über) rot(?:e|er|em)?|"
        r"rote[rn]? ampel\w*|rotlicht\w*|"
        r"(?:au|feu|feux) rouges?|(?:door|bij) rood|rode? licht|(?:na|przy) czerwon\w*|czerwon\w* (?:świat|sygna)\w*|"
        r"(?:col|con il|al|semaforo) rosso|(?:en|con|semáforo) (?:en )?rojo",
    ),
)
_LIGHT_PATTERNS = [(light, re.compile(rf"\b(?:{words})\b", re.I)) for light, words in _LIGHTS]
_OTHER_VEHICLES = re.compile(
    r"\b(?:mopeds?|mofas?|kleinkrafträd\w*|brommers?|bromfiets\w*|snorfiets\w*|cyclomoteurs?|motorower\w*|ciclomotor\w*|motorin[io]|"
    r"e-?scooters?|tractors?|traktor\w*|trekkers?|tracteurs?|ciągnik\w*|trattor\w*|motorhomes?|campers?|campervans?|wohnmobil\w*|"
    r"camping-cars?|kamper\w*|autocamper|autocaravanas?|bicycles?|bikes?|fahrr[aä]d\w*|vélos?|fiets\w*|rower\w*|biciclett\w*|bicicletas?)\b",
    re.I,
)
_MINIMUM = re.compile(r"\b(?:minimum|mindest\w*|minimal\w*|minim[ao]|mínim[ao])\b", re.I)
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
    roads = {road for road, meant in _roads(query) if meant}
    return {**found, "road_type": roads.pop()} if len(roads) == 1 else found


def excluded_roads(query: str) -> set[str]:
    """Kinds of road that the question is not about: "off the motorway"."""
    return {road for road, meant in _roads(query) if not meant}


def _roads(query: str) -> Iterator[tuple[str, bool]]:
    """Each kind of road that is named, and whether it is meant, not excluded."""
    for road, pattern in _ROAD_PATTERNS:
        for each in pattern.finditer(query):
            yield road, _NOT.search(query[: each.start()].rstrip()) is None


def asked_light(query: str) -> str | None:
    """The state of a light that the question is about, of those that are no green; None: none is named."""
    return next((light for light, pattern in _LIGHT_PATTERNS if pattern.search(query)), None)


def names_another_vehicle(query: str) -> bool:
    """Whether the question is about a vehicle of no class of `Situation`, or of one that depends on its mass."""
    return _OTHER_VEHICLES.search(query) is not None


def asks_minimum(query: str) -> bool:
    """Whether a lowest speed is asked for."""
    return _MINIMUM.search(query) is not None
