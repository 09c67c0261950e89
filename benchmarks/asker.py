#!/usr/bin/env python3
"""Asks a rosoclingo why, one question after the other without a pause, as long as it is told to.

usage: asker.py NODE QUESTION...

Each line of the input, whatever it says, begins or ends that. When it has ended, a line of the
output is a JSON list with the milliseconds that each answer took. A question is a word and its
arguments, separated by blanks, as the service ~why has them. It is a process of its own, so that
what it does itself does not hold up who measures.
"""

from __future__ import annotations

import itertools
import json
import sys
import threading
from functools import partial
from typing import List

import rospy

from harness import milliseconds
from rosoclingo.srv import Why, WhyResponse


def main() -> None:
    """Asks until the input ends."""
    node, *questions = rospy.myargv(sys.argv)[1:]
    rospy.init_node("asker", anonymous=True)
    rospy.wait_for_service(f"{node}/why")
    ask = rospy.ServiceProxy(f"{node}/why", Why, persistent=True)
    turn = itertools.cycle([question.split() for question in questions])
    for _ in sys.stdin:
        is_over = threading.Event()
        times: List[float] = []

        def run(is_over: threading.Event = is_over, times: List[float] = times) -> None:
            while not is_over.is_set():
                kind, *arguments = next(turn)
                duration, response = milliseconds(partial(ask, kind, arguments))
                if response.status == WhyResponse.UNANSWERED:
                    print(json.dumps(response.text), flush=True)
                times.append(duration)

        thread = threading.Thread(target=run)
        thread.start()
        sys.stdin.readline()
        is_over.set()
        thread.join()
        print(json.dumps(times), flush=True)


if __name__ == "__main__":
    main()
