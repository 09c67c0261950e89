"""Where the time of planning goes: times, ground instances of each statement, and advice."""
