#! /usr/bin/env python
# Asks for visits, cancels the last one when all have arrived, and prints how they end: a client in the
# style of ROSoClingo 1.0, in Python 2.
import roslib; roslib.load_manifest('rosoclingo')
import sys
import rospy
import actionlib
from rosoclingo.msg import *

client = actionlib.ActionClient('ROSoClingo', ROSoClingoAction)
handlers = {}

def send_goal(place):
 goal = ROSoClingoGoal(request='visit(' + place + ')', information=['to', place])
 print('send: ' + goal.request)
 handlers[place] = client.send_goal(goal)

def example(places):
 client.wait_for_server()
 for place in places:
  send_goal(place)
 for i in range(len(places)):
  while handlers[places[i]].get_comm_state() == actionlib.CommState.WAITING_FOR_GOAL_ACK:
   rospy.sleep(0.05)
 handlers[places[-1]].cancel()
 print('cancel: ' + places[-1])
 for place, handler in sorted(handlers.items()):
  while handler.get_comm_state() != actionlib.CommState.DONE:
   rospy.sleep(0.05)
  print(place, handler.get_result().result)

if __name__ == '__main__':
 try:
  rospy.init_node('human')
  example(rospy.myargv(sys.argv)[1:])
 except rospy.ROSInterruptException as error:
  print('program interrupted before completion:', error, file=sys.stderr)
