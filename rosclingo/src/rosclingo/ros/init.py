"""Starts ROS nodes that Ctrl-C is sure to end, and opens their topics."""

from __future__ import annotations

import contextlib
import gc
import os
import signal
import socket
import sys
import threading
import time
from types import FrameType
from typing import Any, Callable, NoReturn, Optional

import rosgraph
import rosgraph.network
import rosgraph.xmlrpc
import rospy
from rospy.impl import tcpros_base
from rospy.impl.paramserver import get_param_server_cache
from rospy.impl.registration import RegManager, get_registration_listeners

from rosclingo.errors import RosclingoError
from rosclingo.ros.master_watch import exit_status, is_respawned, watch_master
from rosclingo.ros.reminder import Reminder

_SIGNALS = (signal.SIGINT, signal.SIGTERM)
_CALL = b"POST"  # how a call of XML-RPC begins; as a header, it would be more than a GiB long
_SECONDS_TO_RETRY = 30.0  # after which a node that cannot do its work is started again
_LOOKS_SECONDS = 0.5  # how often it is looked whether the node is shut down, if nobody says so
_MASTER_SECONDS = 0.1  # how often it is looked whether there is a master
_SECONDS_TO_REGISTER = 0.5  # how long a shutdown waits for a call that tells the master of a name
# Whether the log messages of all nodes go without the list of the node's topics.
_ROSOUT_PARAMETER = "/rosout_disable_topics_generation"


class _XmlRpcServer(rosgraph.xmlrpc.ThreadingXMLRPCServer):
    """A node's XML-RPC server, whose loop ends when it is closed."""

    def server_close(self) -> None:
        super().server_close()
        threading.Thread(target=self.shutdown, daemon=True).start()


def init_node(name: str, anonymous: bool = False, usage: str = "") -> None:
    """Initialises the node as ``rospy.init_node`` does, but handles SIGINT and SIGTERM itself.

    rospy shuts down inside of the signal handler, which is in the main thread: if that thread is
    just talking to the master, it waits for a lock of its own, for ever. Here a thread shuts down.
    A second signal ends the process at once, and so does the first while there is no master yet.

    Without a master, it waits for one, be there parameters on the command line or not: rospy itself
    would fail to set these.

    A node that the master does not know any more ends, see :func:`.master_watch.watch_master`.

    It also ends the node's server, see :func:`end_server_when_closed`, closes connections that are
    meant for another process, see :func:`_refuse_calls`, lets the master forget the node when that
    ends, with the names that it is just registering, and log without a call of the master. rospy
    subscribes to a parameter at each message, and never unsubscribes: when a node of the same name
    starts later, the master shuts down whatever node has got the old one's port meanwhile.

    And what is there by now, which is modules above all, is looked through for garbage no more, now
    and then and several times at the end: that takes a quarter of the processor time of a node that
    starts and ends.

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
    end_server_when_closed()
    _refuse_calls()
    _wait_for_master()
    rospy.init_node(name, anonymous=anonymous, disable_signals=True)
    for number in _SIGNALS:
        signal.signal(number, _shut_down)
    _wake_registration_at_the_end()
    _let_registrations_end()
    with contextlib.suppress(OSError):  # a master that has just gone, of which rospy tells
        # What has a value in the cache is not subscribed to.
        topics_are_left_out = rospy.get_param(_ROSOUT_PARAMETER, False)
        get_param_server_cache().set(_ROSOUT_PARAMETER, topics_are_left_out)
        rosgraph.Master(rospy.get_name()).unsubscribeParam(rospy.get_node_uri(), _ROSOUT_PARAMETER)
    watch_master()


def end_server_when_closed() -> None:
    """Patches rosgraph so that a node's XML-RPC server ends with it; :func:`init_node` does so.

    rosgraph only closes the server's socket, which its thread then asks again and again, without a
    pause, until the process ends. That takes a core, and holds up the other threads meanwhile: a
    third of the processor time of a node that starts and ends at once.
    """
    rosgraph.xmlrpc.ThreadingXMLRPCServer = _XmlRpcServer


def _refuse_calls() -> None:
    """Patches rospy so that its message port refuses XML-RPC calls.

    When a node was killed and is started again, the master calls the old process, so that it ends.
    The port may be another one's by then, that of this node even. rospy makes one connection after
    the other: it would wait for the header of this one, and nobody could connect any more.
    """
    read_header = tcpros_base.read_ros_handshake_header

    def read(connection: socket.socket, *arguments: Any) -> Any:
        if connection.recv(len(_CALL), socket.MSG_PEEK) == _CALL:
            raise rosgraph.network.ROSHandshakeException("it is a call of another process")
        return read_header(connection, *arguments)

    tcpros_base.read_ros_handshake_header = read


def _wait_for_master() -> None:
    reminder = Reminder(0.0)
    while not rosgraph.is_master_online():
        if reminder.due():
            uri = rosgraph.get_master_uri()
            # The node has no log yet.
            print(
                f"waiting for the ROS master at {uri}; start one with: roscore",
                file=sys.stderr,
                flush=True,
            )
        time.sleep(_MASTER_SECONDS)


def spin() -> None:
    """Waits until the node is shut down, and ends at once then; rospy's looks twice a second."""
    ended = threading.Event()
    rospy.core.add_shutdown_hook(lambda _: ended.set())
    # One that comes when a shutdown is under way is never called.
    while not rospy.is_shutdown():
        ended.wait(_LOOKS_SECONDS)


def on_shutdown(hook: Callable[[], object]) -> None:
    """Calls a function when the node is shut down, or now if that has happened. Thread-safe.

    rospy itself never calls one that is added while a shutdown is under way.

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


def _wake_registration_at_the_end() -> None:
    # rospy waits for its thread, which it wakes before that can see that it is to end.
    listeners = get_registration_listeners().listeners
    managers = [listener for listener in listeners if isinstance(listener, RegManager)]

    def wake(_: str) -> None:
        for manager in managers:
            with manager.cond:
                manager.cond.notify_all()

    rospy.core.add_shutdown_hook(wake)


def _let_registrations_end() -> None:
    # rospy unregisters everything while another thread may still register something, whose call
    # then comes to the master after that one.
    listeners = get_registration_listeners()

    def clear() -> None:
        has_ended = listeners.lock.acquire(timeout=_SECONDS_TO_REGISTER)
        del listeners.listeners[:]
        if has_ended:
            listeners.lock.release()

    listeners.clear = clear


def _shut_down(number: int, _: Optional[FrameType]) -> None:
    for other in _SIGNALS:
        signal.signal(other, signal.SIG_DFL)
    reason = signal.Signals(number).name
    threading.Thread(target=rospy.signal_shutdown, args=(reason,)).start()
