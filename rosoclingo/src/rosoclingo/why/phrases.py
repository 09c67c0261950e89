"""Words for facts in sentences, from an encoding's facts ``phrase(Pattern,Words)``."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Iterable

from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo.why.facts import Fact, FactKind


@dataclass(frozen=True)
class Phrases(TermPhrases):
    """Maps facts to clauses, and terms to words."""

    def clause(self, fact: Fact) -> str:
        """Returns a clause that says a fact."""
        if fact.kind is FactKind.RULE:
            return fact.content
        words = self.find(fact.content)
        if fact.kind is FactKind.REQUEST:
            return words or f"{fact.content} is asked for"
        if fact.kind is FactKind.CANCEL:
            return f"the goal in slot {fact.source} is canceled"
        if fact.kind in (FactKind.ACTION, FactKind.FAILURE):
            failed = fact.kind is FactKind.FAILURE
            if words:
                began = f"{fact.source} {'has failed to' if failed else 'was told to'} {words}"
            else:
                began = f"{fact.source} {'has failed at' if failed else 'was told'} {fact.content}"
            other = f", with {fact.answer}" if failed and fact.answer != "failure" else ""
            return f"{began} in step {fact.step}{other}"
        if words:
            return words
        return fact.content if fact.kind is FactKind.SAVED else f"{fact.source} says {fact.content}"

    def join(self, facts: Iterable[Fact]) -> str:
        """Returns the clauses of some facts, as one text."""
        return join(self.clause(fact) for fact in facts)


def join(clauses: Iterable[str]) -> str:
    """Returns clauses with commas, and "and" before the last."""
    texts = list(clauses)
    return " and ".join(filter(None, [", ".join(texts[:-1]), *texts[-1:]]))
