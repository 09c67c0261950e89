"""The console as a node: hears systems, and calls their services."""
