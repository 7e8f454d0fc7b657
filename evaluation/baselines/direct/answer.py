"""A driver's question under the Direct methods: the front end's answer to its prompt, or that it has no answer.

The answer is one line: formatting and control characters are taken out, and it is cut at 400 characters.
"""

from evaluation.baselines.direct import advise
from evaluation.baselines.direct.advise import DirectSettings
from evaluation.baselines.direct.memory import recalled
from evaluation.baselines.direct.prompt_answer import PromptAnswer
from services.orchestrator.driver.answer import Answer, used
from services.orchestrator.driver.question import subject_of
from services.orchestrator.experts.answers import degraded, failed, results
from services.orchestrator.experts.ask import Ask
from services.orchestrator.speech.wording import say
from services.orchestrator.state import State
from services.orchestrator.text import plain


def direct_answer(question: str, state: State, settings: DirectSettings, ask: Ask) -> Answer:
    """One prompt, with passages if the method has them; nothing else is asked, and no target but the one that stands."""
    outcomes = advise.consult(question, state, settings, ask)[1]
    said = next(iter(results(outcomes, advise.PROMPT, PromptAnswer)), None)
    standing = recalled(state).limit
    return Answer(
        text=plain(said.text, 400) if said is not None and said.text else say(state.preferences, "ask", "nothing"),
        subject=subject_of(question),
        citations=(),
        confidence=max(0.0, min(1.0, said.score)) if said is not None else 0.0,
        target_mps=standing.limit.mps if standing is not None and standing.limit is not None else None,
        tools=used(outcomes),
        language=state.preferences.language,
        degraded=degraded(state, failed(outcomes)),
    )
