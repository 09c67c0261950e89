// A stock client of actionlib's: sends a goal, waits, and says how it has ended.
#include <actionlib/client/simple_action_client.h>
#include <ros/ros.h>
#include <rosoclingo/ROSoClingoAction.h>

#include <iostream>

int main(int argc, char** argv) {
  ros::init(argc, argv, "client");
  actionlib::SimpleActionClient<rosoclingo::ROSoClingoAction> client("rosoclingo", true);
  client.waitForServer();
  rosoclingo::ROSoClingoGoal goal;
  goal.request = argv[1];
  client.sendGoal(goal);
  client.waitForResult();
  std::cout << "end " << client.getState().toString() << std::endl;
}
