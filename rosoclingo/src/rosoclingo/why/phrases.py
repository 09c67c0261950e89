"""Words for facts in sentences, from an encoding's facts ``phrase(Pattern,Words)``.

They stand in a part of the encoding that nobody grounds, so that they cost no planner anything::

    #program phrases.
    phrase("blocked(V,W)", "the way between V and W is blocked").

>>> phrases = Phrases((("blocked(V,W)", "the way between V and W is blocked"),))
>>> phrases.of("blocked(c5,o9)")
'the way between c5 and o9 is blocked'
>>> phrases.of("unblocked(c5,o9)")
'unblocked(c5,o9)'
"""

from __future__ import annotations

import re
from dataclasses import dataclass
from typing import Dict, Iterable, Optional, Tuple

from clingo import ast

from rosclingo.solver.programs import Program
from rosclingo.wire.term_text import split_term
from rosoclingo.why.facts import Fact, FactKind

_VARIABLE = re.compile(r"[A-Z]\w*")
_NAME = re.compile(r"\b[a-z0-9]\w*")


@dataclass(frozen=True)
class Phrases:
    """Maps terms to words, by patterns with variables; the first pattern that matches counts.

    Attributes:
        table: Pairs of pattern and words. Where the words have a variable of the pattern, they get
            what it stands for.
    """

    table: Tuple[Tuple[str, str], ...] = ()

    @classmethod
    def read(cls, program: Program) -> Phrases:
        """Reads the phrases of encodings; more specific patterns come first."""
        heads = (
            str(statement.head)
            for statement in program.statements
            if statement.ast_type is ast.ASTType.Rule and not statement.body
        )
        found = []
        for head in heads:
            name, arguments = split_term(head)
            if name == "phrase" and len(arguments) == 2 and all(map(_is_string, arguments)):
                found.append((_text(arguments[0]).replace(" ", ""), _text(arguments[1])))
        return cls(tuple(sorted(found, key=lambda pair: -len(_NAME.findall(pair[0])))))

    def of(self, term: str) -> str:
        """Returns the words for a term, or the term itself."""
        return self.find(term) or term

    def find(self, term: str) -> Optional[str]:
        """Returns the words for a term, if there are some."""
        for pattern, words in self.table:
            values = _match(pattern, term)
            if values is not None:
                parts = re.split(r"\b([A-Z]\w*)", words)
                return "".join(values.get(part, part) for part in parts)
        return None

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

    def deed(self, action: str) -> str:
        """Returns words for an action, such as ``go to c3``."""
        return self.find(action) or f"do {action}"

    def join(self, facts: Iterable[Fact]) -> str:
        """Returns the clauses of some facts, as one text."""
        return join(self.clause(fact) for fact in facts)


def join(clauses: Iterable[str]) -> str:
    """Returns clauses with commas, and "and" before the last."""
    texts = list(clauses)
    return " and ".join(filter(None, [", ".join(texts[:-1]), *texts[-1:]]))


def _is_string(text: str) -> bool:
    return len(text) > 1 and text[0] == text[-1] == '"'


def _text(string: str) -> str:
    return string[1:-1].replace("\\n", "\n").replace('\\"', '"').replace("\\\\", "\\")


def _match(pattern: str, term: str) -> Optional[Dict[str, str]]:
    """Returns the variables' values of a pattern that matches, or None."""
    if _VARIABLE.fullmatch(pattern):
        return {pattern: term}
    name, places = split_term(pattern)
    other, arguments = split_term(term)
    if (not places and pattern != term) or name != other or len(places) != len(arguments):
        return None
    values: Dict[str, str] = {}
    for place, argument in zip(places, arguments):
        found = _match(place, argument)
        if found is None or any(values.get(key, value) != value for key, value in found.items()):
            return None
        values.update(found)
    return values
