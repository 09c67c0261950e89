"""Nodes that do actions or announce blocked paths, their topics, and a client of move_base."""
