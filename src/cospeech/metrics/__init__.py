"""Measures of agreement between sequences, and bootstrap intervals."""
