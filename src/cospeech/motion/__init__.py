"""The body and its motion: skeleton, markers, Euler angles, unit selection, assembly and smoothing."""
