"""The inbox: a queue of what comes from outside; in a replay, of what came."""
