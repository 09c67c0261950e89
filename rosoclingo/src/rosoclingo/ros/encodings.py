"""Keeps the planner's encoding as its node was started with it, for copies of the planner."""

from __future__ import annotations

import threading
import time
from functools import partial
from typing import Dict, Optional, Tuple

import clingo
from std_msgs.msg import String

from rosclingo.ros.low_latency import subscriber
from rosclingo.solver.options import Options, parse_options
from rosoclingo.encodings.about import Launched
from rosoclingo.encodings.folder import Folder
from rosoclingo.encodings.unpack import unpack
from rosoclingo.errors import LaunchedError, QuestionError, StoreError
from rosoclingo.loop.single.algorithm1 import last_step
from rosoclingo.loop.single.dialects import Dialect2
from rosoclingo.loop.values.phrases import TermPhrases
from rosoclingo.why.task import Encoding

_SECONDS = 10.0  # until a latched message is there, if its node still is
_POLL_SECONDS = 0.01
_LAST_STEP = "steps"  # the constant of a mode


class Encodings:
    """The planner's encoding, and the last step that the mode plans for. Thread-safe.

    The files are written to a folder of this process: they may be on another machine, or may have
    been changed.
    """

    def __init__(self, planner: str, controller: str = "", dialect: str = Dialect2.name) -> None:
        """Prepares; :meth:`listen` subscribes to the nodes.

        Args:
            planner: The resolved name of the node with the encoding.
            controller: That of the node with the mode; empty if there is none.
            dialect: The name of the encoding's dialect.
        """
        self._planner = planner
        self._controller = controller
        self._dialect = dialect
        self._folder: Optional[Folder] = None
        self._abouts: Dict[str, str] = {}
        self._known: Optional[Tuple[Dict[str, str], Encoding]] = None
        self._phrases: Optional[Tuple[str, TermPhrases]] = None  # with what they were read from
        self._lock = threading.Lock()  # guards the others

    def listen(self) -> None:
        """Subscribes to the nodes' ``~about``."""
        for node in (self._planner, self._controller):
            subscriber(f"{node}/about", String, partial(self._on_about, node))

    def _on_about(self, node: str, message: String) -> None:
        self.tell(node, message.data)

    def tell(self, node: str, about: str) -> None:
        """Sets a node's :func:`rosclingo.solver.about.about`."""
        with self._lock:
            self._abouts[node] = about

    def launched(self) -> Dict[str, Launched]:
        """Waits until the nodes say how they were started, and returns that by their names.

        Raises:
            StoreError: One says nothing for long.
            LaunchedError: One says something else.
        """
        nodes = [node for node in (self._planner, self._controller) if node]
        end = time.monotonic() + _SECONDS
        while time.monotonic() < end:
            with self._lock:
                if all(node in self._abouts for node in nodes):
                    return {node: Launched.decode(node, self._abouts[node]) for node in nodes}
            time.sleep(_POLL_SECONDS)
        raise StoreError(
            f"{' and '.join(nodes)} did not say within {_SECONDS:g} s what they were started with, "
            "which a store is compared with; start rosoclingo again"
        )

    def get(self) -> Encoding:
        """Returns the encoding.

        Raises:
            QuestionError: It is still unknown.
            RosclingoError: What was said makes no sense.
            OSError: The files cannot be written.
        """
        with self._lock:
            missing = [n for n in (self._planner, self._controller) if n and n not in self._abouts]
            if missing:
                raise QuestionError(f"{' and '.join(missing)} did not say yet what it plans with")
            if self._known is None or self._known[0] != self._abouts:
                self._known = dict(self._abouts), self._unpack()
            return self._known[1]

    def phrases(self) -> TermPhrases:
        """Returns the encoding's words for terms; none if it is not known yet."""
        with self._lock:
            about = self._abouts.get(self._planner, "")
            if self._phrases is None or self._phrases[0] != about:
                try:
                    files = Launched.decode(self._planner, about).files
                except LaunchedError:
                    files = {}
                self._phrases = about, TermPhrases.read(files.values())
            return self._phrases[1]

    def close(self) -> None:
        """Removes the files."""
        with self._lock:
            if self._folder is not None:
                self._folder.remove()
                self._folder = None

    def _unpack(self) -> Encoding:
        if self._folder is not None:
            self._folder.remove()
        self._folder = Folder()
        options, directory = self._options(self._planner)
        if self._controller:
            limit = _limit(self._options(self._controller)[0])
        else:
            limit = last_step(options.clingo)
        return Encoding(options, directory, self._dialect, limit)

    def _options(self, node: str) -> Tuple[Options, str]:
        """Returns a node's command line with the files in the folder, and the directory."""
        assert self._folder is not None
        try:
            launched = Launched.decode(node, self._abouts[node])
            words, directory = unpack(launched, self._folder.path / node.strip("/"))
        except LaunchedError as err:
            raise QuestionError(f"{err}; start that node again") from err
        return parse_options(words), str(directory)


def _limit(mode: Options) -> Optional[int]:
    """Returns the last step that a mode plans for, if it says so by the usual constant."""
    control = clingo.Control(list(mode.clingo), logger=lambda *_: None)
    try:
        for file in mode.files:
            control.load(file)
    except RuntimeError:  # the mode cannot be used, which others say
        return None
    last = control.get_const(_LAST_STEP)
    return last.number if last is not None and last.type is clingo.SymbolType.Number else None
