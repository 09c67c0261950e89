"""The clients as nodes: a session at a terminal, and the requests that it sends."""
