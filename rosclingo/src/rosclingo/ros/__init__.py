"""The solver node, its client, and helpers for all nodes."""
