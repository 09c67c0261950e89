"""The schedule of a replay: which inputs come when, and how far the run is."""
