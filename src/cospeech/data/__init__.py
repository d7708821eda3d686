"""Tables, segments, trajectories, random numbers and names: the data that all parts of the package share."""
