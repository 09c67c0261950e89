"""One description of a building, and the files that are made from it."""
