"""Deserialises a bag's messages by the definitions in the bag. Needs no ROS."""

from __future__ import annotations

from typing import Any, Dict, Optional

from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from rosoclingo.bags.topics import MD5SUMS, OLDER_MD5SUMS
from rosoclingo.bags.wire import Message, PublisherConnection, rosbags_type

_LONGEST_DEFINITION = 2**16  # characters, with comments; the parser's time grows with the square


class Decoder:
    """Reads messages of the types in :data:`~rosoclingo.bags.topics.MD5SUMS`.

    Those of :data:`~rosoclingo.bags.topics.OLDER_MD5SUMS` lack the fields that came later.
    """

    def __init__(self) -> None:
        self._stores: Dict[PublisherConnection, Any] = {}

    def refuse(self, connection: PublisherConnection, kind: str) -> Optional[str]:
        """Returns why a connection's messages cannot be read as those of a type, or None.

        The MD5 sum decides: definitions whose comments differ have the same.
        """
        known = (MD5SUMS[kind], OLDER_MD5SUMS.get(kind))
        if connection.type != kind or connection.md5sum not in known:
            return (
                f"{connection.topic} was recorded as {connection.type} with the MD5 sum "
                f"{connection.md5sum}, and {kind} has {MD5SUMS[kind]}"
            )
        if len(connection.definition) > _LONGEST_DEFINITION:
            return f"the definition of {kind} that {connection.topic} has is too long to be true"
        try:
            store = get_typestore(Stores.EMPTY)
            store.register(get_types_from_msg(connection.definition, kind))
            _, md5sum = store.generate_msgdef(rosbags_type(kind))
        except Exception as err:  # the parser does not say how it fails at what is no definition
            return f"the definition of {kind} that {connection.topic} has cannot be read: {err}"
        if md5sum != connection.md5sum:
            return (
                f"the definition of {kind} that {connection.topic} has does not have the MD5 sum "
                f"{connection.md5sum}, but {md5sum}"
            )
        self._stores[connection] = store
        return None

    def decode(self, message: Message) -> Any:
        """Reads a message of a connection that was not refused.

        Raises:
            ValueError: The bytes are no message of the connection's type.
        """
        kind = rosbags_type(message.connection.type)
        try:
            return self._stores[message.connection].deserialize_ros1(message.data, kind)
        except Exception as err:  # generated code, which fails at short data in many ways
            raise ValueError(f"{message.connection.topic}: no {kind}: {err}") from err
