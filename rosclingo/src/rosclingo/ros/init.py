"""Starts ROS nodes that Ctrl-C is sure to end, and opens their topics."""

from __future__ import annotations

import gc
import os
import signal
import sys
import threading
import time
import xmlrpc.client
from types import FrameType
from typing import Callable, NoReturn, Optional, Sequence
from xml.parsers.expat import ExpatError

import rosgraph
import rospy
import yaml

from rosclingo import strict_yaml
from rosclingo.errors import ParameterError, RosclingoError, shorten
from rosclingo.ros.master_watch import exit_status, is_respawned, watch_master
from rosclingo.ros.patches import init_patched_node
from rosclingo.ros.reminder import Reminder

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_SECONDS_TO_RETRY = 30.0  # after which a node that cannot do its work is started again
_LOOKS_SECONDS = 0.5  # how often it is polled whether the node is shut down
_MASTER_SECONDS = 0.1  # how often it is polled whether there is a master


def init_node(name: str, anonymous: bool = False, usage: str = "") -> None:
    """Initialises the node as ``rospy.init_node`` does, with patches and other signals.

    The patches are those of :mod:`rosclingo.ros.patches`. ``rospy.core._ros_signal``
    shuts the node down in the handler of SIGINT and SIGTERM, which interrupts the main thread: what
    needs a lock of that thread waits, for ever. Here another thread shuts down. A second signal
    ends the process at once, and so does the first while there is no master yet.

    ``rospy.init_node`` fails without a master if the command line has parameters. This waits for a
    master.

    A node that the master does not know any more ends, see :func:`.master_watch.watch_master`.

    A parameter of the command line, or an address of the master, that is wrong ends the process
    with exit status 2, and says what is wrong with it.

    What is imported by now is left out of garbage collection: a full one would take 25 ms, while
    a robot waits.

    Args:
        name: Name of the node, which a remapping of ``__name`` replaces.
        anonymous: Whether to make the name unique.
        usage: What ``-h`` and ``--help`` print, before the process ends; nothing to ignore them.
    """
    if usage and not {"-h", "--help"}.isdisjoint(sys.argv[1:]):
        print(usage)
        sys.exit(0)
    for number in _SIGNALS:
        signal.signal(number, signal.SIG_DFL)
    gc.freeze()
    try:
        _check_parameters(sys.argv)
        _wait_for_master()
    except ParameterError as err:
        print(f"{name}: {err}", file=sys.stderr, flush=True)
        end_wrong()
    init_patched_node(name, anonymous=anonymous)
    for number in _SIGNALS:
        signal.signal(number, _shut_down)
    watch_master()


def _check_parameters(arguments: Sequence[str]) -> None:
    """Validates the parameters of a command line, such as ``_p:=1``.

    ``rospy.init_node`` ends with a traceback if one is no YAML, or no value of XML-RPC.

    Raises:
        ParameterError: One is wrong.
    """
    for argument in filter(rosgraph.names.is_legal_remap, arguments):
        if argument.count(rosgraph.names.REMAP) > 1:
            raise ParameterError(
                f"the word {shorten(argument)!r} of the command line: expected := once"
            )
        name, text = (part.strip() for part in argument.split(rosgraph.names.REMAP))
        if not text or len(name) < 2 or name[0] != "_" or name[1] == "_":  # as rospy has it
            continue
        place = f"the parameter {name} of the command line, {shorten(text)!r}"
        try:
            value = strict_yaml.load(text)
        except yaml.YAMLError as err:
            raise ParameterError(
                f"{place}, is wrong as YAML: {err}. A text with signs of YAML is in quotes for "
                f"YAML, and then for the shell, as in {name}:=\"'*'\""
            ) from err
        try:
            xmlrpc.client.loads(xmlrpc.client.dumps((value,)).encode())
        except (TypeError, ValueError, OverflowError, ExpatError) as err:
            raise ParameterError(
                f"{place}, cannot be a parameter of ROS: {err}. If it is a text, it is in quotes "
                f"for YAML, and then for the shell, as in {name}:=\"'2026-01-01'\""
            ) from err


def _wait_for_master() -> None:
    """Waits until there is a master.

    Raises:
        ParameterError: Its address is invalid.
    """
    try:
        uri = rosgraph.get_master_uri()
        master = rosgraph.Master("rosgraph", uri)
    except (ValueError, OSError) as err:
        raise ParameterError(
            f"the address of the ROS master, ROS_MASTER_URI or __master:=, is wrong: {err}; "
            "expected one such as http://localhost:11311"
        ) from err
    reminder = Reminder(0.0)
    while not master.is_online():
        if reminder.due():
            # The node has no log yet.
            print(
                f"waiting for the ROS master at {uri}; start one with: roscore",
                file=sys.stderr,
                flush=True,
            )
        time.sleep(_MASTER_SECONDS)


def spin(ended: Optional[threading.Event] = None) -> None:
    """Blocks until the node is shut down.

    ``rospy.spin`` looks twice a second: a node took 0.4 s longer to end.

    Args:
        ended: Ends the wait, too, when it is set.
    """
    ended = ended or threading.Event()
    rospy.core.add_shutdown_hook(lambda _: ended.set())
    # One that comes when a shutdown is under way is never called.
    while not (rospy.is_shutdown() or ended.is_set()):
        ended.wait(_LOOKS_SECONDS)


def on_shutdown(hook: Callable[[], object]) -> None:
    """Calls a function when the node is shut down, or now if that has happened. Thread-safe.

    ``rospy.on_shutdown`` adds a hook while ``rospy.signal_shutdown`` calls them, which forgets them
    then: the hook would never be called.

    Args:
        hook: The function, which may be called twice.
    """
    rospy.on_shutdown(hook)
    if rospy.is_shutdown():
        hook()


def give_up(reason: object, status: int = 2) -> NoReturn:
    """Says why the node ends, and ends the process with an exit status."""
    rospy.logfatal("%s", reason)
    rospy.signal_shutdown(str(reason))
    end_wrong(status)


def end_wrong(status: int = 2) -> NoReturn:
    """Ends a process that cannot do its work, but later if roslaunch is to start it again.

    roslaunch does so at once, whatever the exit status. Launch files with ``respawn`` say it by the
    environment variable ``ROSCLINGO_RESPAWN``. A signal ends the process at once. Called by the
    main thread.

    Args:
        status: The exit status.
    """
    if is_respawned():
        for number in _SIGNALS:
            signal.signal(number, signal.SIG_DFL)
        print(
            f"this node is started again in {_SECONDS_TO_RETRY:g} s, and at once by: "
            f"kill {os.getpid()}",
            file=sys.stderr,
            flush=True,
        )
        time.sleep(_SECONDS_TO_RETRY)
    sys.exit(exit_status(status))


def run_node(make: Callable[[], object]) -> NoReturn:
    """Runs a node until it is shut down, and ends the process.

    Args:
        make: Makes what has to live as long as the node, which is initialised.

    The exit status is 0, or 2 if that raises one of our errors.
    """
    try:
        node = make()
    except RosclingoError as err:
        give_up(err)
    spin()
    del node
    sys.exit(0)


def log_clingo(message: str) -> None:
    """Logs one of clingo's messages: at level WARN if it is a warning or an error."""
    log = rospy.logwarn if "warning:" in message or "error:" in message else rospy.loginfo
    log("clingo: %s", message)


def _shut_down(number: int, _: Optional[FrameType]) -> None:
    for other in _SIGNALS:
        signal.signal(other, signal.SIG_DFL)
    reason = signal.Signals(number).name
    threading.Thread(target=rospy.signal_shutdown, args=(reason,)).start()
