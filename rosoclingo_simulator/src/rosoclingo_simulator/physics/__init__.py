"""What moves and where: maps, robots that roll and touch, boxes in their way, lasers."""
