"""Compilation of kernels, the cache of compiled code, and the hash of the source code."""
