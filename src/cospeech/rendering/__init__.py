"""Figures, pictures and videos of moving bodies."""
