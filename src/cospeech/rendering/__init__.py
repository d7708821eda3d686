"""Rendering: figures, still images and videos of moving bodies."""
