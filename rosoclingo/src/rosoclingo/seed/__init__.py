"""A first plan by Fast Downward: the task that it is given, its process, its plan in layers."""
