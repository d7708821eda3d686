"""The body and its motion: skeleton, markers, Euler angles, motion libraries, unit selection, assembly, blending."""
