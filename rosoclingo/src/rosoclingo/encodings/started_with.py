"""Fingerprint of the solvers' files and options, which must not change before a run resumes.

>>> planner = Launched("/planner", "rosclingo run.py", ("-fa.lp", "-cn=2"), {"/x/a.lp": "a."})
>>> started_with({"planner": planner})
{'the options of planner': '-c n=2', 'the file a.lp of planner': '5ab640fad553'}
"""

from __future__ import annotations

import os
from typing import Dict, Mapping

from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.unpack import options

_DIGITS = 12  # of a hash, enough to tell files of one name apart


def started_with(solvers: Mapping[str, Launched]) -> Dict[str, str]:
    """Returns the options and digests that are compared when a run resumes, by what they are of.

    Where files are does not count, what is in them does.

    Args:
        solvers: How each was started, by its role.

    Raises:
        LaunchedError: A command line is wrong.
    """
    found: Dict[str, str] = {}
    for solver, launched in solvers.items():
        words = [f"{o} {v}".strip() for o, v in options(launched) if o != "-f"]
        found[f"the options of {solver}"] = " ".join(words) or "none"
        for path, digest in launched.digests().items():
            what = f"the file {os.path.basename(path)} of {solver}"
            found[what] = " and ".join(filter(None, [found.get(what), digest[:_DIGITS]]))
    return found
