"""Measures of agreement between sequences, and their intervals."""
