"""Plans, executes, monitors and replans a robot's tasks with two clingo solvers.

Only :mod:`rosoclingo.node` needs ROS; everything else runs, and is tested, without it.
"""
