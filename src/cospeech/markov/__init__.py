"""Markov models of sequences of symbols and features, with their compiled kernels."""
