"""The node that draws a map and what goes on in it, and its messages."""
