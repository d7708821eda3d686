"""Compilation of kernels, its cache, and the hash of the code."""
