"""Physics of a simulation: maps, robots that roll and touch, boxes in their way, lasers."""
