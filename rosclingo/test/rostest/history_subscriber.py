"""Subscribes to each topic that a line of its input names, and prints the numbers that come."""

from __future__ import annotations

import sys

import rospy
from std_msgs.msg import String


def _show(message: String, topic: str) -> None:
    number, _, _ = message.data.partition(" ")
    sys.stdout.write(f"{topic} {number}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    rospy.init_node("history_subscriber", anonymous=True, disable_rosout=True)
    print("ready", flush=True)
    for line in sys.stdin:
        rospy.Subscriber(line.strip(), String, _show, line.strip(), tcp_nodelay=True)
