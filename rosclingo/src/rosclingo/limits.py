"""Limits of the texts that other nodes send, all in one place.

They are far above what a robot's task needs, and keep a sender that is broken from filling memory,
journal and disk. What is longer is dropped, or refused with a sentence, where it comes in:
docs/security.md, section "Sizes". A solver's requests have a parameter instead.

>>> too_long(id="robot", value="x" * 20_000)
'value has 20000 characters; an input has at most 16384 in all, so send less'
>>> too_long(information=["left", "right"])
>>> too_long(information=["left"] * 2_000)
'information has 2000 texts, and at most 1000 are taken; send fewer'
"""

from __future__ import annotations

from typing import Optional, Sequence, Union

MOST_ID = 1_000
"""Characters of a goal's id."""

MOST_TEXT = 16_384
"""Characters of all texts of an input: a message, an answer, a goal, a request of an operator."""

MOST_TEXTS = 1_000
"""Texts in a list, such as what comes with a goal."""


def too_long(**texts: Union[str, Sequence[str]]) -> Optional[str]:
    """Checks the size of an input.

    Args:
        texts: Its texts, or lists of texts, by their names.

    Returns:
        A sentence that says what is too long, and what is allowed; None if nothing is.
    """
    sizes = {}
    for name, text in texts.items():
        if not isinstance(text, str) and len(text) > MOST_TEXTS:
            return f"{name} has {len(text)} texts, and at most {MOST_TEXTS} are taken; send fewer"
        sizes[name] = len(text) if isinstance(text, str) else sum(map(len, text))
    if sum(sizes.values()) <= MOST_TEXT:
        return None
    longest = max(sizes, key=sizes.__getitem__)
    return (
        f"{longest} has {sizes[longest]} characters; an input has at most {MOST_TEXT} in all, so "
        "send less"
    )
