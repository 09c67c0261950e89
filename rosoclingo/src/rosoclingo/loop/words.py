"""Reserved ids and values on ``~in`` and ``~out``, and names of the terms of ``~plan``."""

from __future__ import annotations

SUCCESS, FAILURE = "success", "failure"
"""Usual answers to an action."""

UNKNOWN = "unknown"
"""The answer of an interface that cannot know whether its action was done."""

TIMEOUT = "timeout"
"""The answer in the place of an actuator that has not answered in time."""

LOST = "lost"
"""The answer in the place of an actuator whose interface is gone: it sends no heartbeats."""

GIVEN_UP = (TIMEOUT, LOST)
"""The answers that rosoclingo gives itself, in the place of an actuator."""

BUSY = "busy"
"""What the loop says of an actuator that goes on with its action in the next step."""

PASSED, INTERRUPTED = "passed", "interrupted"
"""What the loop says of a step: that it has gone by, or has ended before anybody has answered."""

CLOCK = "clock"
"""The event that tells the time: ``clock(N)``, N whole seconds after the first reading."""

TRIES = "tries"
"""The event that counts tries: ``tries(R,C)``, R answers after it has tried C times."""

INFO = "info"
"""The id of messages without an actuator: observations, and messages of the loop itself."""

QUEUE = "queue"
"""The source of the events ``first(Request)``, for requests that get a slot before others."""

SOLVER = "solver"
"""The id of a message that holds a whole plan, for no actuator."""

ABORT = "abort"
"""The action that ends what an actuator does, for a plan with ``abort(R,T)``."""

EXPECTED = "expected"
"""Functor of the expected time of a goal, in its feedback and in ``~plan``."""

DUE = "due"
"""Functor of a goal's deadline in ``~plan``."""

TIMED = "timed"
"""Functor of the begin and end of an action in ``~plan``."""

NOW = "now"
"""Functor of the current time in ``~plan``, to which its other times are related."""
