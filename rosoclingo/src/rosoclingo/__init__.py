"""Plans, executes, monitors and replans a robot's tasks with two clingo solvers.

Folders: :mod:`.loop`, the planning loop, with a search of its own, :mod:`.engine`; :mod:`.single`,
the one-node system; :mod:`.store`, durable runs; :mod:`.why`, explanations of plans; :mod:`.bags`,
recording, replay and reports; and :mod:`.ros`, the nodes. For authors of encodings: :mod:`.desk`
plans in one process, with :mod:`.profile` and pictures by :mod:`.drawing`; :mod:`.check` tests
encodings; :mod:`.pddl` imports tasks; :mod:`.scaffold` writes a package. A user adds commands to
:mod:`.commands`. Only :mod:`.ros` needs ROS, and in :mod:`.bags` recording and replay.
"""

import rosclingo  # noqa: F401 (finds the libraries that our Debian packages bring along)
