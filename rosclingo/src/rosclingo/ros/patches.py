"""Patches of rosgraph and rospy, each of which mends a fault that is there in 1.15.15.

What mends actionlib are subclasses, in :mod:`.action_client` and :mod:`.action_server`.
rosclingo/test/system/test_patches.py has a test of each patch that fails without it.
"""

from __future__ import annotations

import contextlib
import socket
import threading
from typing import Any, Sequence
from weakref import WeakValueDictionary

import rosgraph
import rosgraph.network
import rosgraph.xmlrpc
import rospy
from rospy.impl import tcpros_base
from rospy.impl.masterslave import ROSHandler
from rospy.impl.paramserver import get_param_server_cache
from rospy.impl.registration import RegManager, get_registration_listeners
from rospy.impl.tcpros import get_tcpros_handler

_CALL = b"POST"  # how a call of XML-RPC begins; as a header, it would be more than a GiB long
_SECONDS_TO_REGISTER = 0.5  # how long a shutdown waits for a call that tells the master of a name
_ROSOUT_PARAMETER = "/rosout_disable_topics_generation"


def init_patched_node(name: str, **options: Any) -> None:
    """Calls ``rospy.init_node`` without rospy's signal handlers, and applies the patches.

    Args:
        name: Name of the node.
        options: Further arguments of ``rospy.init_node``.
    """
    _end_server_when_closed()
    _refuse_calls()
    _connect_once()
    _keep_newer_publishers()
    rospy.init_node(name, disable_signals=True, **options)
    _wake_registration_at_shutdown()
    _wait_for_registrations_at_shutdown()
    _do_not_subscribe_to_parameters()


def set_tcp_nodelay(topic: str) -> None:
    """Sets TCP_NODELAY for all connections of a topic that is to be published.

    ``rospy.Publisher`` does so after it has told the master of the topic: who connects at once has
    a connection without it.

    Args:
        topic: Name of the topic.
    """
    if rospy.core.is_initialized():
        get_tcpros_handler().set_tcp_nodelay(rospy.resolve_name(topic), True)


class _XmlRpcServer(rosgraph.xmlrpc.ThreadingXMLRPCServer):
    def server_close(self) -> None:
        super().server_close()
        threading.Thread(target=self.shutdown, daemon=True).start()


def _end_server_when_closed() -> None:
    """Ends the loop of a node's XML-RPC server when the server is closed.

    ``rosgraph.xmlrpc.XmlRpcNode.shutdown`` closes the socket and does not call the server's
    ``shutdown``. So ``serve_forever`` goes on: it asks a closed socket without a pause until the
    process ends, which takes a core.
    """
    rosgraph.xmlrpc.ThreadingXMLRPCServer = _XmlRpcServer


def _refuse_calls() -> None:
    """Closes connections to a node's TCPROS port that begin with a call of XML-RPC.

    ``rospy.impl.tcpros_base.TCPServer.run`` reads the header of one connection after the other,
    in ``read_ros_handshake_header``, without a timeout. When a node was killed and is started
    again, the master calls the old one's XML-RPC port, which may be the TCPROS port of another node
    by then: that node waits for the rest of a header, and accepts no more connections.
    """
    read_header = tcpros_base.read_ros_handshake_header

    def read(connection: socket.socket, *arguments: Any) -> Any:
        if connection.recv(len(_CALL), socket.MSG_PEEK) == _CALL:
            raise rosgraph.network.ROSHandshakeException("it is a call of another process")
        return read_header(connection, *arguments)

    tcpros_base.read_ros_handshake_header = read


def _connect_once() -> None:
    """Has a node that hears twice of a publisher at the same time connect to it once.

    ``rospy.impl.masterslave.ROSHandler._connect_topic`` asks the publisher for its port when it has
    seen no connection, and makes one, which closes any that has come meanwhile. When a second
    publisher of the topic registers during that, the master tells of both: the first is connected
    to again, and a message that is under way on its first connection is lost.
    """
    connect = ROSHandler._connect_topic
    locks: WeakValueDictionary[Any, Any] = WeakValueDictionary()
    guard = threading.Lock()

    def connect_once(handler: ROSHandler, topic: str, publisher: str) -> Any:
        with guard:
            lock = locks.setdefault((topic, publisher), threading.Lock())
        with lock:
            return connect(handler, topic, publisher)

    ROSHandler._connect_topic = connect_once


def _keep_newer_publishers() -> None:
    """Keeps the publishers of a list that an older list of the same topic overtakes.

    ``rospy.impl.registration.RegManager.reg_added`` queues the publishers that the master returns
    for a new subscriber. When one registers at that time, the master's ``publisherUpdate`` may be
    queued before them. ``RegManager.run`` takes the last list for the newest and drops the other:
    the subscriber never connects to that publisher.
    """

    def queue_update(manager: RegManager, topic: str, publishers: Sequence[str]) -> None:
        with manager.cond:
            queued = [one for name, names in manager.updates if name == topic for one in names]
            manager.updates.append((topic, list(dict.fromkeys([*publishers, *queued]))))
            manager.cond.notify_all()

    RegManager.publisher_update = queue_update


def _wake_registration_at_shutdown() -> None:
    """Ends rospy's registration thread as soon as the node is shut down.

    ``rospy.impl.registration.RegManager.cleanup`` wakes the thread before ``is_shutdown`` is true,
    so that the thread waits again, and ``rospy.signal_shutdown`` for the thread: each node took
    0.5 s longer to end.
    """
    listeners = get_registration_listeners().listeners
    managers = [listener for listener in listeners if isinstance(listener, RegManager)]

    def wake(_: str) -> None:
        for manager in managers:
            with manager.cond:
                manager.cond.notify_all()

    rospy.core.add_shutdown_hook(wake)


def _wait_for_registrations_at_shutdown() -> None:
    """Delays a shutdown's unregistrations until pending registrations are done.

    ``rospy.impl.registration.RegistrationListeners.clear`` does not wait for another thread that is
    in ``notify_added``: the call that registers a topic comes to the master after those that
    unregister all, and the master takes the node for one that runs.
    """
    listeners = get_registration_listeners()

    def clear() -> None:
        has_ended = listeners.lock.acquire(timeout=_SECONDS_TO_REGISTER)
        del listeners.listeners[:]
        if has_ended:
            listeners.lock.release()

    listeners.clear = clear


def _do_not_subscribe_to_parameters() -> None:
    """Has log messages look up a parameter that the node has, instead of subscribing to it.

    ``rospy.impl.rosout._rosout`` calls ``get_param_cached`` for each message, which subscribes to
    the parameter and is never unsubscribed. The master keeps the ended node's address for that,
    and when a node of the same name starts, it shuts down whichever node has the address by then.
    """
    with contextlib.suppress(OSError):  # a master that has just gone, of which rospy tells
        topics_are_left_out = rospy.get_param(_ROSOUT_PARAMETER, False)
        get_param_server_cache().set(_ROSOUT_PARAMETER, topics_are_left_out)
        # rospy has logged already.
        rosgraph.Master(rospy.get_name()).unsubscribeParam(rospy.get_node_uri(), _ROSOUT_PARAMETER)
