"""The simulator's node: topics, services and the action of each robot, maps, the clock."""
