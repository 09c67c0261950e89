"""The console as a node: subscribes to systems, and calls their services."""
