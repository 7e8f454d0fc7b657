"""What the Rules service says in its own words, in the driver's language."""

from collections.abc import Mapping, Sequence

LANGUAGES = ("en", "de", "fr")
MOST_NAMED = 3

_SAID: dict[str, tuple[str, str, str]] = {
    "posted": ("Posted limit {limit}.", "Angezeigtes Limit {limit}.", "Limite affichée {limit}."),
    "gantry": ("Limit {limit} on the gantry.", "Limit {limit} auf der Anzeigebrücke.", "Limite {limit} sur le portique."),
    "temporary": ("Temporary limit {limit}.", "Vorübergehendes Limit {limit}.", "Limite temporaire {limit}."),
    "zone": ("Zone limit {limit}.", "Zonenlimit {limit}.", "Limite de zone {limit}."),
    "conditional": ("Limit {limit} when wet.", "Limit {limit} bei Nässe.", "Limite {limit} par temps de pluie."),
    "default": ("General limit {limit} here.", "Allgemeines Limit hier {limit}.", "Limite générale ici {limit}."),
    "cap": ("No more than {limit}: {why}.", "Höchstens {limit}: {why}.", "Au plus {limit} : {why}."),
    "advisory": (
        "No general limit; {limit} is advised.",
        "Kein allgemeines Limit; Richtgeschwindigkeit {limit}.",
        "Pas de limite générale ; {limit} conseillés.",
    ),
    "uncertain": (
        "The sign was not read for certain: taken as {limit} for now.",
        "Das Schild ist nicht sicher gelesen: vorerst gilt {limit}.",
        "Le panneau n'est pas lu avec certitude : {limit} par prudence.",
    ),
    "conflict": (
        "Signs contradict each other: the lower value counts.",
        "Die Anzeigen widersprechen sich: Es zählt der niedrigere Wert.",
        "Les panneaux se contredisent : la valeur la plus basse compte.",
    ),
    "presumed": (
        "Unknown, so taken at its worst: {facts}.",
        "Unbekannt, daher ungünstig angenommen: {facts}.",
        "Inconnu, supposé défavorable : {facts}.",
    ),
    "country_unknown": (
        "Country unknown: the most careful of {packs} is taken.",
        "Land unbekannt: Es gilt das Vorsichtigste aus {packs}.",
        "Pays inconnu : le plus prudent de {packs} est retenu.",
    ),
    "packs": ("{count} rulepacks", "{count} Regelwerken", "{count} recueils de règles"),
    "part_unknown": (
        "Part of the country unknown: the lowest limit of {packs} is taken.",
        "Landesteil unbekannt: Es gilt das niedrigste Limit aus {packs}.",
        "Région inconnue : la limite la plus basse de {packs} est retenue.",
    ),
    "no_law_here": (
        "No rulepack for {country}: the most careful of {packs} is taken.",
        "Kein Regelwerk für {country}: Es gilt das Vorsichtigste aus {packs}.",
        "Pas de règles pour {country} : le plus prudent de {packs} est retenu.",
    ),
    "no_limit_known": ("No limit is known here.", "Hier ist kein Limit bekannt.", "Aucune limite connue ici."),
    "stale": (
        "Rulepack {have} is older than the expected {want}.",
        "Das Regelwerk {have} ist älter als das erwartete {want}.",
        "Les règles {have} sont plus anciennes que {want}.",
    ),
    "out_of_date": (
        "The rulepack is not in force on this date.",
        "Das Regelwerk gilt an diesem Tag nicht.",
        "Ces règles ne sont pas en vigueur à cette date.",
    ),
    "no_retrieval": (
        "Without retrieval: from typed provisions and the sign table.",
        "Ohne Suche: aus typisierten Vorschriften und Zeichentafel.",
        "Sans recherche : d'après les dispositions typées et la table des panneaux.",
    ),
    "unit": (
        "{limit} is about {converted}.",
        "{limit} sind etwa {converted}.",
        "{limit} font environ {converted}.",
    ),
    "part_lower": (
        "It is lower in {parts}: {limit}.",
        "Niedriger ist es in {parts}: {limit}.",
        "Plus basse ailleurs ({parts}) : {limit}.",
    ),
    "and": (" and ", " und ", " et "),
    "signs_differ": (
        "The signs demand different things: the most careful counts.",
        "Die Zeichen verlangen Verschiedenes: Es zählt das Vorsichtigste.",
        "Les panneaux se contredisent : le plus prudent compte.",
    ),
    "foreign": (
        "This is no sign of {here}; in {there} it means:",
        "Dieses Zeichen gibt es in {here} nicht; in {there} bedeutet es:",
        "Ce panneau n'existe pas en {here} ; en {there} il signifie :",
    ),
    "unknown_sign": (
        "This sign is not in the sign table: drive with care.",
        "Dieses Zeichen steht nicht in der Zeichentafel: vorsichtig fahren.",
        "Ce panneau est absent de la table : prudence.",
    ),
    "maybe_sign": (
        "It may also be: {others}.",
        "Es könnte auch sein: {others}.",
        "Ce peut être aussi : {others}.",
    ),
    "visibility": ("visibility", "Sichtweite", "visibilité"),
    "wet": ("wet road", "nasse Fahrbahn", "chaussée mouillée"),
    "lit": ("street lamps", "Straßenlaternen", "éclairage public"),
    "divided": ("divided carriageways", "getrennte Fahrbahnen", "chaussées séparées"),
    "snow_chains": ("snow chains", "Schneeketten", "chaînes à neige"),
    "novice": ("probationary licence", "Führerschein auf Probe", "permis probatoire"),
    "electric": ("electric car", "Elektroauto", "voiture électrique"),
    "plate_100": ("approval for 100 km/h", "Zulassung für 100 km/h", "autorisation pour 100 km/h"),
    "mass": ("mass of the vehicle", "Masse des Fahrzeugs", "masse du véhicule"),
    "trailer": ("mass of the trailer", "Masse des Anhängers", "masse de la remorque"),
    "combination": ("mass of the combination", "Masse des Zuges", "masse de l'ensemble"),
    "road_name": ("number of the road", "Nummer der Straße", "numéro de la route"),
    "day": ("date", "Datum", "date"),
    "vehicle": ("vehicle class", "Fahrzeugklasse", "catégorie de véhicule"),
    "road": ("type of road", "Straßenart", "type de route"),
    "lane": ("lane", "Fahrstreifen", "voie"),
    "sign_here": ("sign", "Schild", "panneau"),
    "zone_here": ("zone", "Zone", "zone"),
    "time": ("time of day", "Uhrzeit", "heure"),
    "snow": ("snow", "Schnee", "neige"),
    "why_vehicle": ("class of vehicle", "Fahrzeugklasse", "catégorie de véhicule"),
    "why_posted": ("road with a lower limit", "Strecke mit niedrigerem Limit", "section à limite plus basse"),
    "why_lit": ("road with street lamps", "Straße mit Laternen", "route éclairée"),
    "why_everywhere": ("on any road", "auf allen Straßen", "sur toute route"),
    "why_road": ("kind of street", "Art der Straße", "type de rue"),
    "limit_depends": (
        "The limit depends on: {facts}.",
        "Das Limit hängt ab von: {facts}.",
        "La limite dépend de : {facts}.",
    ),
    "nothing_found": (
        "Nothing in the rulepacks answers this.",
        "Die Regelwerke geben darauf keine Antwort.",
        "Les règles n'apportent pas de réponse.",
    ),
}  # fmt: skip

COUNTRIES: dict[str, tuple[str, str, str]] = {
    "DEU": ("Germany", "Deutschland", "Allemagne"),
    "GBR": ("Great Britain", "Großbritannien", "Grande-Bretagne"),
    "FRA": ("France", "Frankreich", "France"),
    "NLD": ("the Netherlands", "die Niederlande", "Pays-Bas"),
    "AUT": ("Austria", "Österreich", "Autriche"),
    "POL": ("Poland", "Polen", "Pologne"),
    "CHE": ("Switzerland", "die Schweiz", "Suisse"),
    "BEL": ("Belgium", "Belgien", "Belgique"),
    "IRL": ("Ireland", "Irland", "Irlande"),
    "USA": ("the United States", "die Vereinigten Staaten", "États-Unis"),
    "XXX": ("the Vienna Convention", "das Wiener Übereinkommen", "la Convention de Vienne"),
    "ZZZ": ("the test country", "das Testland", "pays d'essai"),
}


PARTS: dict[str, tuple[str, str, str]] = {
    "GBR-WLS": ("Wales", "Wales", "pays de Galles"),
    "GBR-SCT": ("Scotland", "Schottland", "Écosse"),
    "GBR-NIR": ("Northern Ireland", "Nordirland", "Irlande du Nord"),
    "BEL-BRU": ("Brussels", "Brüssel", "Bruxelles"),
    "BEL-VLG": ("Flanders", "Flandern", "Flandre"),
    "BEL-WAL": ("Wallonia", "der Wallonie", "Wallonie"),
    "USA-CA": ("California", "Kalifornien", "Californie"),
}


def spoken_language(language: str) -> str:
    """One of ours: `de-AT` is German, what we do not speak becomes English."""
    short = language.lower()[:2]
    return short if short in LANGUAGES else "en"


def say(key: str, language: str, **values: str) -> str:
    """A sentence of the table, filled."""
    return _SAID[key][LANGUAGES.index(spoken_language(language))].format(**values)


def country(code: str, language: str) -> str:
    """A country's name; its code where we have no name for it, `?` where that is no code."""
    names = COUNTRIES.get(code[:3])
    return names[LANGUAGES.index(spoken_language(language))] if names else _code(code[:3])


def part(code: str, language: str) -> str:
    """The name of a part of a country; its code where we have no name for it."""
    names = PARTS.get(code)
    return names[LANGUAGES.index(spoken_language(language))] if names else code


def named_packs(ids: Sequence[str], language: str) -> str:
    """Packs by name; how many, where they are too many to be named."""
    return ", ".join(ids) if len(ids) <= MOST_NAMED else say("packs", language, count=str(len(ids)))


def _code(text: str) -> str:
    return text if text.isascii() and text.isalpha() else "?"


def text_in(texts: Mapping[str, str], language: str) -> str:
    """A text of a pack in the driver's language, else in English, else in any."""
    return texts.get(spoken_language(language)) or texts.get("en") or next(iter(texts.values()), "")
