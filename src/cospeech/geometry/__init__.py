"""Rotations, cameras, triangulation and filters."""
