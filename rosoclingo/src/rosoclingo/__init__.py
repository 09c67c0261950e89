"""Plans, executes, monitors and replans a robot's tasks with two clingo solvers.

From the bottom up: :mod:`.engine` is a search for plans, :mod:`.loop` the planning loop, with the
one-node system, and :mod:`.store` keeps its runs durable. :mod:`.in_process` runs it all in one
process, and :mod:`.encodings` reads what an encoding declares. :mod:`.why` explains plans, and
:mod:`.ros` has the nodes. :mod:`.drawing` draws maps; :mod:`.bags` records, replays, compares and
reports runs; :mod:`.tools` are the commands for authors of encodings. Beside these rooms, a user
adds commands to :mod:`.commands`, and :mod:`.errors` has the errors of all.

Only :mod:`.ros` and the folder ``ros`` of :mod:`.bags` need ROS.
"""

import rosclingo  # noqa: F401 (finds the libraries that our Debian packages bring along)
