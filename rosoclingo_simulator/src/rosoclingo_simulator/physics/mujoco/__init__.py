"""Physics and pictures by MuJoCo, which are imported only if they are wanted."""
