"""clingo behind a ROS service and an action.

Folders, from the bottom up: :mod:`.wire`, :mod:`.solver` and :mod:`.ros`. Only the last needs ROS;
everything else runs, and is tested, without it.
"""

from rosclingo.libraries import add_private_libraries

add_private_libraries()
