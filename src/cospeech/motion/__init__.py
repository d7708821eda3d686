"""The body and its motion: skeleton, markers, unit selection, assembly, smoothing."""
