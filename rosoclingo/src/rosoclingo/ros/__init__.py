"""The nodes: the planning loop with two solvers, and the one with its own."""
