"""clingo with a program: commands, searches, and what untrusted programs may not do."""
