#! /usr/bin/env python
# Says of each action that it went well, and prints for whom the first one is: an interface in the
# style of ROSoClingo 1.0, in Python 2.
import rospy
from rosoclingo.msg import ROSoClingoOut, ROSoClingoIn
from rosoclingo.srv import GetGoalInformation

done = {}
information = rospy.ServiceProxy('/ROSoClingo/get_goal_information', GetGoalInformation)
topic = rospy.Publisher('/ROSoClingo/in', ROSoClingoIn, latch=True)

def rosoclingoout_callback(message):
 if message.id not in done:
  done[message.id] = 0
  print('information:', ' '.join(information('1').information))
 done[message.id] += 1
 print('action %d of' % done[message.id], message.id + ':', message.action)
 out_message = ROSoClingoIn()
 out_message.id = message.id
 out_message.value = 'success'
 topic.publish(out_message)

rospy.init_node('interface')
rospy.Subscriber('/ROSoClingo/out', ROSoClingoOut, rosoclingoout_callback)
rospy.spin()
