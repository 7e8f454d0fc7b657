"""One table of sentences: what the prompt lists, the grammar gives and the parser understands is the same."""

import pytest
from hypothesis import given
from hypothesis import strategies as st

from evaluation.baselines.direct.forms import ABSTENTION, FORMS, Form, grammar, listed
from evaluation.baselines.direct.parsed_advice import NO_ADVICE, advice_of, sentences
from evaluation.baselines.direct.template import EXAMPLES, INSTRUCTION, Asked, filled, load
from services.drivelm.vocabulary.jurisdictions import allowed_limits
from tests.unit.evaluation.baselines.direct import gbnf

ANY = st.text(max_size=300)


@given(line=gbnf.sentences(grammar()))
def test_every_sentence_of_the_grammar_is_understood_by_the_parser(line: str) -> None:
    assert line.startswith(" ")
    assert line.endswith("\n")
    assert len(line.strip().splitlines()) == 1
    for said in sentences(line):
        assert said == ABSTENTION or advice_of(said) != NO_ADVICE


@pytest.mark.parametrize("form", FORMS, ids=lambda form: form.text)
def test_every_form_is_in_the_prompts_and_means_what_the_table_says(form: Form) -> None:
    said = form.text.format(n="30 mph")
    advice = advice_of(said)
    assert (advice.action, advice.hazard) == (form.action, form.hazard)
    assert form.text.format(n="N mph") in listed()
    assert all(listed() in load(name).head for name in (INSTRUCTION, EXAMPLES))


@given(text=ANY)
def test_whatever_a_model_says_is_advice_of_a_known_form_or_nothing(text: str) -> None:
    advice = advice_of(text)
    assert (advice.value is not None) == (advice.action in ("limit", "limit_ahead"))
    assert advice.value is None or advice.value in allowed_limits(None, advice.unit)
    assert (advice.hazard != "") == (advice.action == "hazard")


def test_examples_are_answered_in_the_forms_and_show_what_stands_in_them() -> None:
    prompt = load(EXAMPLES)
    for example in prompt.template.examples:
        advice = advice_of(example.answer)
        assert example.answer == ABSTENTION or advice != NO_ADVICE
        held = " ".join((example.context, *example.passages, *example.tools))
        assert advice.value is None or f"{advice.value:g} {advice.unit}" in held
        assert f"Query: {example.query}\nAnswer: {example.answer}\n\n" in prompt.head


def test_all_prompts_of_a_template_begin_alike_and_its_hash_tells_a_change() -> None:
    first, other = load(EXAMPLES), load(INSTRUCTION)
    assert filled(first, Asked("c", "q", ("p",), ("t",))).startswith(first.head)
    assert filled(first, Asked("c", "q", ("p",), ("t",))).endswith(
        "c\nTools:\n- t\nPassages:\n- p\n\nQuery: q\nAnswer:"
    )
    assert first.sha256 != other.sha256
