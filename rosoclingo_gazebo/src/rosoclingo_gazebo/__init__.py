"""The manual's office: checks before its start, and the demos."""
