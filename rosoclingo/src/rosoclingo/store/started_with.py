"""Fingerprint of the solvers' files and options, which must not change before a run resumes.

>>> about = '{"arguments": ["-f", "a.lp", "-c", "n=2"], "files": {"/x/a.lp": {"sha256": "12ab"}}}'
>>> started_with({"planner": about})
{'the options of planner': '-c n=2', 'the file a.lp of planner': '12ab'}
"""

from __future__ import annotations

import json
import os
from typing import Dict, Mapping

from rosclingo.errors import RosclingoError
from rosclingo.solver.options import arguments
from rosoclingo.errors import StoreError

_DIGITS = 12  # of a hash, enough to tell files of one name apart


def started_with(abouts: Mapping[str, str]) -> Dict[str, str]:
    """Returns the options and digests that are compared when a run resumes, by what they are of.

    Where files are does not count, what is in them does.

    Args:
        abouts: For each solver what :func:`rosclingo.solver.about.about` says of it.

    Raises:
        StoreError: That is not what a solver says.
    """
    found: Dict[str, str] = {}
    for solver, text in abouts.items():
        try:
            about = json.loads(text)
            words = [f"{o} {v}".strip() for o, v in arguments(about["arguments"]) if o != "-f"]
            files = {path: file["sha256"] for path, file in about["files"].items()}
        except (ValueError, KeyError, TypeError, AttributeError, RosclingoError) as err:
            raise StoreError(f"{solver} does not say what it was started with: {err!r}") from err
        found[f"the options of {solver}"] = " ".join(words) or "none"
        for path, digest in files.items():
            what = f"the file {os.path.basename(path)} of {solver}"
            found[what] = " and ".join(filter(None, [found.get(what), digest[:_DIGITS]]))
    return found
