"""Retrieved passages beside an answer from typed provisions: do they point at the same law?"""

from collections.abc import Mapping

import msgspec

from domain.languages import spoken_language
from proto.rules import Passage, Retrieved, RulesAnswer, Situation
from services.rules.lookup.rule_lookup import WITHOUT_RETRIEVAL, provision_of
from services.rules.words import say

UNCONFIRMED = 0.95
"""Factor where retrieval answers but finds none of the provisions that the answer rests on."""
BM25_ONLY = 0.97
"""Factor where retrieval ranks without an encoder."""
_QUESTIONS: dict[str, dict[str, str]] = {
    "en": {
        "posted": "speed limit shown by a sign, how long it applies",
        "gantry": "speed limit shown on a variable sign above the lane",
        "zone": "speed limit zone, start and end",
        "conditional": "speed limit on a wet road or in poor visibility",
        "default": "general speed limit in built-up areas and outside",
        "advisory": "advisory speed on motorways without a general limit",
        "unknown": "speed limit",
    },
    "de": {
        "posted": "durch Zeichen 274 angeordnete Höchstgeschwindigkeit, wie lange sie gilt",
        "gantry": "Höchstgeschwindigkeit auf Wechselverkehrszeichen über dem Fahrstreifen",
        "zone": "Tempo-Zone, Beginn und Ende",
        "conditional": "Höchstgeschwindigkeit bei Nässe oder geringer Sichtweite",
        "default": "allgemeine Höchstgeschwindigkeit innerhalb und außerhalb geschlossener Ortschaften",
        "advisory": "Richtgeschwindigkeit auf Autobahnen ohne allgemeines Limit",
        "unknown": "Höchstgeschwindigkeit",
    },
    "fr": {
        "posted": "limite de vitesse affichée par un panneau, jusqu'où elle vaut",
        "gantry": "limite de vitesse affichée sur un panneau variable au-dessus de la voie",
        "zone": "zone à vitesse limitée, début et fin",
        "conditional": "limite de vitesse par temps de pluie ou par mauvaise visibilité",
        "default": "limite générale de vitesse en agglomération et hors agglomération",
        "advisory": "vitesse conseillée sur autoroute sans limite générale",
        "unknown": "limite de vitesse",
    },
    "nl": {
        "posted": "maximumsnelheid aangegeven door een bord, tot waar die geldt",
        "gantry": "maximumsnelheid op een matrixbord boven de rijstrook",
        "zone": "snelheidszone, begin en einde",
        "conditional": "maximumsnelheid bij nat wegdek of slecht zicht",
        "default": "algemene maximumsnelheid binnen en buiten de bebouwde kom",
        "advisory": "adviessnelheid op autosnelwegen zonder algemene limiet",
        "unknown": "maximumsnelheid",
    },
    "pl": {
        "posted": "dopuszczalna prędkość określona znakiem, dokąd obowiązuje",
        "gantry": "dopuszczalna prędkość na znaku zmiennej treści nad pasem ruchu",
        "zone": "strefa ograniczonej prędkości, początek i koniec",
        "conditional": "dopuszczalna prędkość na mokrej nawierzchni lub przy słabej widoczności",
        "default": "dopuszczalna prędkość w obszarze zabudowanym i poza nim",
        "advisory": "prędkość zalecana na autostradach bez ogólnego ograniczenia",
        "unknown": "dopuszczalna prędkość",
    },
    "it": {
        "posted": "limite di velocità indicato da un segnale, fin dove vale",
        "gantry": "limite di velocità su un pannello a messaggio variabile sopra la corsia",
        "zone": "zona a velocità limitata, inizio e fine",
        "conditional": "limite di velocità con strada bagnata o scarsa visibilità",
        "default": "limite generale di velocità nei centri abitati e fuori",
        "advisory": "velocità consigliata in autostrada senza limite generale",
        "unknown": "limite di velocità",
    },
    "es": {
        "posted": "límite de velocidad indicado por una señal, hasta dónde vale",
        "gantry": "límite de velocidad en un panel variable sobre el carril",
        "zone": "zona de velocidad limitada, inicio y fin",
        "conditional": "límite de velocidad con calzada mojada o mala visibilidad",
        "default": "límite general de velocidad en poblado y fuera de poblado",
        "advisory": "velocidad aconsejada en autopista sin límite general",
        "unknown": "límite de velocidad",
    },
}


def question_for(answer: RulesAnswer, language: str) -> str:
    """What retrieval is asked to support an answer: one question for each basis, so that repeats are cached."""
    return _QUESTIONS[spoken_language(language)].get(answer.basis, "speed limit")


def questions(language: str) -> tuple[str, ...]:
    """All of them, for warming up."""
    return tuple(_QUESTIONS[spoken_language(language)].values())


def supported(
    answer: RulesAnswer, retrieved: Retrieved | None, situation: Situation, versions: Mapping[str, str] | None = None
) -> RulesAnswer:
    """The answer with its confidence lowered where retrieval is missing, weak, or points elsewhere. Never raised.

    `versions`: tag by pack id of the texts in use; a passage of another version confirms nothing.
    """
    if retrieved is None:
        return msgspec.structs.replace(
            answer,
            confidence=answer.confidence * WITHOUT_RETRIEVAL,
            note=f"{answer.note} {say('no_retrieval', situation.language)}",
            degraded=(*answer.degraded, "retrieval"),
        )
    factor = (
        1.0 if _confirmed(answer, tuple(p for p in retrieved.passages if current(p, versions or {}))) else UNCONFIRMED
    )
    weak = retrieved.encoder.startswith("bm25-only")
    return msgspec.structs.replace(
        answer,
        confidence=answer.confidence * factor * (BM25_ONLY if weak else 1.0),
        degraded=(*answer.degraded, "encoder") if weak else answer.degraded,
    )


def from_memory(answer: RulesAnswer) -> RulesAnswer:
    """An answer whose evidence was retrieved earlier, now that retrieval is gone: as sure as it was, and said to be degraded."""
    degraded = answer.degraded if "retrieval" in answer.degraded else (*answer.degraded, "retrieval")
    return msgspec.structs.replace(answer, degraded=degraded)


def current(passage: Passage, versions: Mapping[str, str]) -> bool:
    """Whether a passage is of the version that is in use here."""
    tag = passage.rulepack_version
    return versions.get(tag.partition("@")[0], tag) == tag


def _confirmed(answer: RulesAnswer, passages: tuple[Passage, ...]) -> bool:
    return bool({c.provision for c in answer.citations} & {provision_of(passage) for passage in passages})
