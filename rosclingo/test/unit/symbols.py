"""Ground terms as clingo makes them."""

from __future__ import annotations

import clingo
from clingo import Function, Number, String
from hypothesis import strategies as st

GROUND = st.recursive(
    st.integers(-(2**31) + 1, 2**31 - 1).map(Number)
    | st.text(st.characters(min_codepoint=1, exclude_categories=["Cs"]), max_size=5).map(String)
    | st.sampled_from([clingo.Infimum, clingo.Supremum, Function("a"), Function("a", [], False)]),
    lambda inner: st.builds(
        Function, st.sampled_from(["f", "_g'", ""]), st.lists(inner, min_size=1, max_size=3)
    ),
    max_leaves=8,
)
