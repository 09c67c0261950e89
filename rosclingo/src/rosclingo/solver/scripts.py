"""Python scripts in trusted encodings, and the functions that each program can call.

clingo runs a ``#script (python)`` block by itself once a language is registered. Its own
registration runs the code in the module ``__main__``, where a program that a client sends could
call whatever the node's script has imported; here each solver has a namespace for its scripts.
"""

from __future__ import annotations

import contextlib
from contextvars import ContextVar
from typing import Any, Dict, Iterable, Iterator, Union

import clingo
from clingo.script import Script, register_script

Namespace = Dict[str, Any]
"""The functions that the programs of one solver can call: our own, and those of its scripts."""

# A context belongs to one thread, and clingo calls back in the thread that called it.
_CURRENT: ContextVar[Namespace] = ContextVar("_CURRENT")


class _PythonScript(Script):
    """Runs scripts and finds the functions that they define, for calls such as ``@size(X)``."""

    @property
    def namespace(self) -> Namespace:
        """The namespace of the solver that is at work in this thread."""
        return _CURRENT.get({})

    def execute(self, location: Any, code: str) -> None:
        exec(compile(code, str(location), "exec"), self.namespace)  # noqa: S102 (its very purpose)

    def call(
        self, location: Any, name: str, arguments: Iterable[clingo.Symbol]
    ) -> Union[Iterable[clingo.Symbol], clingo.Symbol]:
        result: Union[Iterable[clingo.Symbol], clingo.Symbol] = self.namespace[name](*arguments)
        return result

    def callable(self, name: str) -> bool:
        return not name.startswith("__") and callable(self.namespace.get(name))


register_script("python", _PythonScript())
# clingo looks for functions only in languages of which it has run a script.
clingo.Control().add("base", (), "#script (python) #end.")


@contextlib.contextmanager
def using(namespace: Namespace) -> Iterator[None]:
    """Gives this thread's scripts a namespace; what they define is forgotten if the block fails."""
    before = dict(namespace)
    token = _CURRENT.set(namespace)
    try:
        yield
    except BaseException:
        namespace.clear()
        namespace.update(before)
        raise
    finally:
        _CURRENT.reset(token)


def reason(message: str) -> str:
    """Returns clingo's message, of a script's traceback only the last line.

    The lines before it name files of the node; they are logged for the operator.
    """
    begin, traceback, rest = message.partition("Traceback (most recent call last):\n")
    if not traceback:
        return message
    import logging  # noqa: PLC0415 (see rosclingo.errors)

    logging.getLogger("rosout").warning("a script failed: %s", message)
    return begin + rest.strip().rpartition("\n")[2]
