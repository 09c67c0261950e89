"""Topics with TCP_NODELAY.

Without it, TCP's Nagle algorithm delays small messages. rospy keeps the setting by topic: all
publishers and subscribers of a node share a topic's connections. So the first one that opens a
topic by this module sets it for all others of that topic.
"""

from __future__ import annotations

from typing import Any, Callable, Dict, Iterable, Optional

import rospy

from rosclingo.ros.patches import set_tcp_nodelay

# Messages for a slow client. actionlib's 50 are too few when many goals end at once: a client whose
# result is dropped waits for ever.
_QUEUE_SIZE = 10_000


class _Publisher(rospy.Publisher):
    def publish(self, *args: Any, **kwds: Any) -> None:
        """Publishes a message, unless the node is shutting down.

        ``rospy.topics._PublisherImpl.publish`` raises "publish() to a closed topic" after
        ``RegManager.cleanup`` has closed the topics, until ``rospy.is_shutdown`` is true.
        """
        try:
            super().publish(*args, **kwds)
        except rospy.ROSException:
            if not rospy.core.is_shutdown_requested():
                raise


class _Listener(rospy.SubscribeListener):
    def __init__(self, connected: Callable[[Callable[[Any], None]], None]) -> None:
        super().__init__()
        self._connected = connected

    def peer_subscribe(self, _name: str, _all: Any, send: Callable[[Any], None]) -> None:
        self._connected(send)


def publisher(
    topic: str,
    kind: Any,
    latch: bool = False,
    queue_size: int = _QUEUE_SIZE,
    *,
    on_subscriber: Optional[Callable[[Callable[[Any], None]], None]] = None,
    headers: Optional[Dict[str, str]] = None,
) -> rospy.Publisher:
    """Opens a topic to publish messages of a kind, with TCP_NODELAY and a long queue.

    Args:
        topic: Name of the topic.
        kind: Type of the messages.
        latch: Whether a late subscriber gets the last message.
        queue_size: How many messages wait for a slow subscriber.
        on_subscriber: Called for each new subscriber, in a thread of rospy's, with a function that
            sends it a message. rospy does not guard what goes to one subscriber from what goes to
            all: whoever gives this has to guard the topic.
        headers: Fields that subscribers find in the headers of the connections.
    """
    listener = None if on_subscriber is None else _Listener(on_subscriber)
    set_tcp_nodelay(topic)
    return _Publisher(
        topic,
        kind,
        listener,
        tcp_nodelay=True,
        latch=latch,
        headers=headers,
        queue_size=queue_size,
    )


def subscriber(
    topic: str, kind: Any, callback: Optional[Callable[[Any], None]] = None
) -> rospy.Subscriber:
    """Opens a topic to receive messages of a kind, with TCP_NODELAY."""
    return rospy.Subscriber(topic, kind, callback, tcp_nodelay=True)


def batch_of(kind: Any) -> Any:
    """Returns a class of messages that are several of a kind, and that are sent in one write.

    What is published is a buffer, to which ``rospy.msg.serialize_message`` has a message write
    itself, and in front of which it puts the length up to where the message has left the buffer's
    position. Behind that position stand the others, each with its own length.
    """

    class Batch(kind):
        __slots__ = ("messages",)

        def __init__(self, messages: Iterable[Any]) -> None:
            super().__init__()
            self.messages = tuple(messages)  # one at least

        def serialize(self, buff: Any) -> None:
            first, *others = self.messages
            first.serialize(buff)
            end = buff.tell()
            for message in others:
                rospy.msg.serialize_message(buff, 0, message)
            buff.seek(end)

    return Batch
