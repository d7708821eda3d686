"""Markov models of label and feature streams, with their compiled kernels."""
