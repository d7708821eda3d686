"""Tracking: from films to marker positions in every view and in 3D."""
