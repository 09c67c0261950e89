#!/usr/bin/env python3
"""A service that answers at once: the least that any rospy service costs."""

import rospy

from rosclingo.srv import ROSClingoControl

REPLY = "<return>\n<success>\nTrue\n</success>\n</return>"


def main() -> None:
    """Serves until the node is shut down."""
    rospy.init_node("echo")
    rospy.Service("~control", ROSClingoControl, lambda _: REPLY)
    rospy.spin()


if __name__ == "__main__":
    main()
