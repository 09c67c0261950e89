"""The demos, the paper's third scenario and a fleet: told line by line, with pictures of them."""
