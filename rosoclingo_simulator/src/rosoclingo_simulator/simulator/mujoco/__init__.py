"""Physics and cameras by MuJoCo, which only the node imports, and only if it is wanted."""
