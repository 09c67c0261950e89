"""Nodes with rosclingo.ros.patches and rosclingo.ros.init: each fault of rospy that these mend.

Needs a sourced workspace, in devel or install space.
"""

from __future__ import annotations

import contextlib
import socket
from xmlrpc.client import ServerProxy

from terminals import TIMEOUT, Terminals, terminals, wait_for

__all__ = ["terminals"]

# rospy is at its hooks when another one is added.
HOOKED = """
import os, signal, threading
import rospy
from rosclingo.ros.init import init_node, on_shutdown

entered, goes_on = threading.Event(), threading.Event()

def hook():
    entered.set()
    goes_on.wait()

init_node("hooked")
rospy.on_shutdown(hook)
os.kill(os.getpid(), signal.SIGINT)
entered.wait()
threading.Timer(0.2, goes_on.set).start()
on_shutdown(lambda: print("called", flush=True))
"""


def test_a_hook_that_is_added_during_a_shutdown_is_called(terminals: Terminals) -> None:
    node = terminals.run("python", "-c", HOOKED)
    assert node.wait() == 0
    assert "called" in node.output


# A thread publishes when rospy has closed the topics, and does not say yet that it shuts down.
PUBLISHING = """
import rospy
from std_msgs.msg import Empty
from rosclingo.ros.init import init_node
from rosclingo.ros.low_latency import publisher

def publish(_):
    topic.publish()
    print("published", flush=True)

init_node("publishing")
topic = publisher("late", Empty)
rospy.core.add_preshutdown_hook(publish)
"""


def test_a_message_that_is_published_during_a_shutdown(terminals: Terminals) -> None:
    node = terminals.run("python", "-c", PUBLISHING)
    assert "published" in node.output


# A topic that we publish, and one to which we subscribe: whoever sends has to have the option.
SENDING = """
import socket, threading
import rospy
from std_msgs.msg import Empty
from rosclingo.ros.init import init_node
from rosclingo.ros.low_latency import publisher, subscriber

init_node("sending")
topics = [publisher("published", Empty), rospy.Publisher("subscribed", Empty, queue_size=1)]
listener = subscriber("subscribed", Empty)
pause = threading.Event()
for topic in topics:
    while not topic.impl.connections:
        pause.wait(0.01)
    (connection,) = topic.impl.connections
    option = connection.socket.getsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY)
    print(f"{topic.name}: {bool(option)}", flush=True)
rospy.spin()
"""


def test_no_message_waits_for_the_acknowledgement_of_another(terminals: Terminals) -> None:
    node = terminals.start("python", "-c", SENDING)
    # Without the field tcp_nodelay, which rospy always sends.
    terminals.listen("/sending", "/published")
    node.wait_for("/subscribed: ")
    assert "/published: True" in node.output
    assert "/subscribed: True" in node.output


# As soon as the master may be told of the topic, it has the option.
OPENING = """
import rospy
from rospy.impl.registration import RegistrationListener, get_registration_listeners
from rospy.impl.tcpros import get_tcpros_handler
from std_msgs.msg import Empty
from rosclingo.ros.init import init_node
from rosclingo.ros.low_latency import publisher

class Listener(RegistrationListener):
    def reg_added(self, name, kind, way):
        print(f"{name}: {get_tcpros_handler().tcp_nodelay_map.get(name)}", flush=True)

init_node("opening")
get_registration_listeners().add_listener(Listener())
topics = [publisher("published", Empty), publisher("~own", Empty)]
"""


def test_who_connects_at_once_waits_for_no_acknowledgement_either(terminals: Terminals) -> None:
    node = terminals.run("python", "-c", OPENING)
    assert node.output.splitlines()[:2] == ["/published: True", "/opening/own: True"]


ENDING = """
import os, signal, sys, threading, time
import rospy
from rosclingo.ros.init import init_node

def serves(thread):
    frame = sys._current_frames().get(thread.ident)
    while frame and frame.f_code.co_name != "serve_forever":
        frame = frame.f_back
    return frame is not None

def serving():
    return [thread for thread in threading.enumerate() if serves(thread)]

init_node("ending")
rospy.loginfo("begins")
rospy.on_shutdown(lambda: rospy.loginfo("ends"))
print("served:", bool(serving()))
os.kill(os.getpid(), signal.SIGINT)
rospy.spin()
end = time.monotonic() + 30
while serving() and time.monotonic() < end:  # rospy has begun it by _thread, so join refuses it
    time.sleep(0.01)
print("served at the end:", bool(serving()))
"""


def test_nothing_is_left_of_a_node_that_has_ended(terminals: Terminals) -> None:
    """The master would shut down whoever gets its port, when the next one of its name starts."""
    node = terminals.run("python", "-c", ENDING)
    assert node.wait() == 0
    assert terminals.master.lookupNode("/test", "/ending") == [-1, "unknown node [/ending]", ""]
    assert "Traceback" not in node.output
    assert "served: True" in node.output
    assert "served at the end: False" in node.output  # rospy's would ask a closed socket for ever


REGISTERING = """
import os, signal, threading
import rospy
from rospy.impl import registration
from std_msgs.msg import Empty
from rosclingo.ros.init import init_node, spin

init_node("registering")
ask, has_begun, ends = registration.xmlrpcapi, threading.Event(), threading.Event()
rospy.core.add_preshutdown_hook(lambda reason: ends.set())  # after those that unregister

class Slow:
    def __init__(self, uri):
        self.registerPublisher = lambda *words: self.call(ask(uri), *words)

    def call(self, master, *words):
        has_begun.set()
        ends.wait(0.2)
        return master.registerPublisher(*words)

registration.xmlrpcapi = Slow
thread = threading.Thread(target=rospy.Publisher, args=("late", Empty), kwargs={"queue_size": 1})
thread.start()
has_begun.wait()
registration.xmlrpcapi = ask
os.kill(os.getpid(), signal.SIGINT)
spin()
thread.join()
"""


def test_nothing_is_left_of_a_thread_that_opens_topics(terminals: Terminals) -> None:
    node = terminals.run("python", "-c", REGISTERING)
    assert node.wait() == 0, node.output
    assert terminals.master.lookupNode("/test", "/registering")[0] == -1
    _, _, (publishers, _, _) = terminals.master.getSystemState("/test")
    assert "/late" not in {topic for topic, _ in publishers}


# While one thread asks a publisher for its port, another one hears of the same publisher.
CONNECTING = """
import threading
import rospy
from rospy.impl import masterslave
from rospy.impl.registration import RegManager, get_registration_listeners
from std_msgs.msg import String
from rosclingo.ros.init import init_node

def ask_late(uri, **options):
    if not others:
        others.append(threading.Thread(target=tell, args=("/twice", uri)))
        others[0].start()
        others[0].join(0.5)  # it waits until this one has connected
    return ask(uri, **options)

def tell(*arguments):
    told = connect(*arguments)
    print(f"told: {told[1]}\\n", end="", flush=True)
    return told

init_node("connecting")
ask, others = masterslave.xmlrpcapi, []
masterslave.xmlrpcapi = ask_late
(manager,) = [l for l in get_registration_listeners().listeners if isinstance(l, RegManager)]
connect = manager.handler._connect_topic
manager.handler._connect_topic = tell
rospy.Subscriber("twice", String, lambda text: print("heard:", text.data, flush=True))
rospy.spin()
"""


def test_a_publisher_that_is_told_twice(terminals: Terminals) -> None:
    """The second connection would close the first, and lose what is under way on that."""
    terminals.publish("/twice", "std_msgs/String", "data: hello")
    node = terminals.start("python", "-c", CONNECTING)
    node.wait_for("heard: hello")
    wait_for(lambda: node.output.count("told: ") == 2)
    assert node.output.count("told: Connected") == 1
    assert "already connected" in node.output


# The master's answer to a new subscriber, without publishers, is queued after its update with one.
OVERTAKEN = """
import threading
import rospy
from rospy.impl.registration import RegManager
from std_msgs.msg import String
from rosclingo.ros.init import init_node

init_node("overtaken")
queue_update, newer, has_come = RegManager.publisher_update, [], threading.Event()

def queue_in_the_wrong_order(manager, topic, publishers):
    if topic != "/late":
        queue_update(manager, topic, publishers)
    elif publishers:
        newer.extend(publishers)
        has_come.set()
    else:
        print("registered", flush=True)
        has_come.wait()
        with manager.cond:  # so that both are there when the registration thread looks
            queue_update(manager, topic, newer)
            queue_update(manager, topic, publishers)

RegManager.publisher_update = queue_in_the_wrong_order
rospy.Subscriber("/late", String, lambda message: print("heard:", message.data, flush=True))
rospy.spin()
"""


def test_a_publisher_that_registers_with_its_subscriber(terminals: Terminals) -> None:
    """An older list of publishers does not replace a newer one."""
    node = terminals.start("python", "-c", OVERTAKEN)
    node.wait_for("registered")
    terminals.publish("/late", "std_msgs/String", "data: hello")
    node.wait_for("heard: hello")


# The registration thread waits until it is woken, for as long as that may take.
WAITING = """
import os, signal, threading
import rospy
from rospy.impl.registration import RegManager, get_registration_listeners
from rosclingo.ros.init import init_node

init_node("waiting")
(manager,) = [l for l in get_registration_listeners().listeners if isinstance(l, RegManager)]
wait, waits = manager.cond.wait, threading.Semaphore(0)

def wait_for_ever(_):
    waits.release()
    wait()

manager.cond.wait = wait_for_ever
waits.acquire()
rospy.core.add_preshutdown_hook(lambda _: waits.acquire())  # when rospy has woken it
(thread,) = rospy.core._shutdown_threads
rospy.signal_shutdown("the end")
print("waits:", thread.is_alive(), flush=True)
os._exit(0)
"""


def test_a_node_ends_without_a_wait(terminals: Terminals) -> None:
    node = terminals.run("python", "-c", WAITING)
    assert "waits: False" in node.output


# The main thread holds a lock, which what ends the node needs, too.
LOCKED = """
import os, signal, threading
import rospy
from rosclingo.ros.init import init_node, spin

def hook():
    print("locked:", not lock.acquire(timeout=10), flush=True)

init_node("locked")
lock = threading.Lock()
rospy.on_shutdown(hook)
with lock:
    os.kill(os.getpid(), signal.SIGINT)
spin()
"""


def test_a_signal_interrupts_no_thread(terminals: Terminals) -> None:
    node = terminals.run("python", "-c", LOCKED)
    assert node.wait() == 0
    assert "locked: False" in node.output


def test_a_call_for_another_process(terminals: Terminals) -> None:
    """An HTTP request on the port of topics is refused, and others can connect."""
    node = terminals.start("rosrun", "rosclingo", "run.py")
    node.wait_for("/rosclingo is ready")
    there = ServerProxy(terminals.master.lookupNode("/test", "/rosclingo")[2])
    _, host, port = there.requestTopic("/test", "/rosclingo/about", [["TCPROS"]])[2]
    with socket.create_connection((host, port)) as caller:
        caller.sendall(b"POST / HTTP/1.1\r\n")
        caller.settimeout(TIMEOUT)
        with contextlib.suppress(ConnectionResetError):
            assert caller.recv(1) == b""
        terminals.listen("/rosclingo", "/rosclingo/about").wait_for("rosclingo run.py")
