#! /usr/bin/env python
# Tells a solver node of an external and asks for an answer set: a client of ROSClingo in Python 2,
# which writes its XML by hand.
import roslib; roslib.load_manifest('rosclingo')
import sys
import rospy
import actionlib
from rosclingo.msg import *
from rosclingo.srv import *
import xml.etree.ElementTree as ET

COMMANDS = '''<commands>
<restart/>
<add name="switch">
<parameter_definition name="n"/>
<program> #external on(n). lit(n) :- on(n). #show lit/1. </program>
</add>
<ground>
<program name="switch">
<parameter value="1"/>
</program>
<program name="switch">
<parameter value="2"/>
</program>
</ground>
<assign_external name="on(1)" value="True"/>
<cleanup_domains/>
<get_externals/>
<get_stats/>
</commands>'''

ASSUMPTIONS = '''<assumptions>
<assumption name="lit(2)" value="False"/>
</assumptions>'''

def text(element):
 return element.text.strip()

rospy.init_node('solver_client')
rospy.wait_for_service('/rosclingo/control')
control = rospy.ServiceProxy('/rosclingo/control', ROSClingoControl)
reply = ET.fromstring(control(COMMANDS).result)
print('success:', text(reply.find('success')))
for external in reply.find("externals"):
 print(external.attrib['name'], external.attrib['value'])
print('stats:', len(text(reply.find('stats'))) > 0)
client = actionlib.SimpleActionClient('rosclingo', ROSClingoAction)
client.wait_for_server()
client.send_goal(ROSClingoGoal(assumptions=ASSUMPTIONS))
client.wait_for_result()
result = client.get_result()
print('result:', result.result)
print('interrupted:', result.interrupted)
print('answerset:', result.answerset)
