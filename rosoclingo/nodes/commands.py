"""The commands that a controller's mode may give: the file to edit, as in the manual.

A mode's answer set holds ``do(controller,Command,1)``. The method with the command's name is called
with the command's arguments, which are clingo symbols. So a method that is added here is a new
command, such as ``do(controller,say("hello"),1)``:

    class ROSCommands(Standard):
        def say(self, text):
            self.state.environment.info(str(text))
"""

from __future__ import annotations

from rosoclingo.commands import ROSCommands as Standard


class ROSCommands(Standard):
    """The standard commands."""
