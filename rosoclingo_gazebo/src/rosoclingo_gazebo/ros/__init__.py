"""The demos as nodes, what kills nodes meanwhile, and a check for the packages of navigation."""
