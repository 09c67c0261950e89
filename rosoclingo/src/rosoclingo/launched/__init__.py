"""Nodes as they were started: decoded from their ``~about``, compared, and unpacked to files."""
