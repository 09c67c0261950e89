"""Plans, executes, monitors and replans a robot's tasks with two clingo solvers.

Folders, from the bottom up: :mod:`.loop`, the planning loop; :mod:`.single`, the system in one
node; :mod:`.ros`, the nodes; and :mod:`.bags`, what records and replays them. The commands that a
user may add to are in :mod:`.commands`. Only :mod:`.ros` needs ROS, and what records and replays.
"""
