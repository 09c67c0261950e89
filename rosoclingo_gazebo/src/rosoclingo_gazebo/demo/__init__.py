"""The paper's third scenario in the simulated office, told line by line, with a picture of it."""
