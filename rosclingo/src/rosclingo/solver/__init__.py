"""A clingo solver with a program: commands, searches, and a sandbox for untrusted programs."""
