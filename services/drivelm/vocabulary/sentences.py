"""The front end's language: questions it is asked, and the sentence it says for each class it can tell apart.

The forms follow DriveLM's questions and answers on traffic elements ("What kind of traffic sign is ...?"). The parser
(`parser.py`) reads these sentences back; the pair is a closed loop that a test walks for every class.
"""

from collections.abc import Mapping
from types import MappingProxyType

from services.drivelm.vocabulary.classes import OTHER, WORDS

# What a picture of each kind of box is asked.
QUESTIONS: Mapping[str, str] = MappingProxyType(
    {
        "sign": "What kind of traffic sign is shown, and what does it say?",
        "plate": "What does the supplementary plate below the traffic sign say?",
        "panel": "What does the variable message panel on the gantry show?",
        "light": "What is the state of the traffic light?",
    }
)
KIND_OF_QUESTION: Mapping[str, str] = MappingProxyType({question: kind for kind, question in QUESTIONS.items()})

_FORMS = {
    "sign": "The traffic sign is {}.",
    "plate": "The plate says {}.",
    "panel": "The panel shows {}.",
    "light": "The traffic light is {}.",
}
SENTENCES: Mapping[str, str] = MappingProxyType(
    {
        **{code: _FORMS[kind].format(words) for kind, classes in WORDS.items() for code, words in classes.items()},
        OTHER: "There is no readable traffic element.",
    }
)
"""Class to sentence."""
