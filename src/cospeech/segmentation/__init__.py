"""Segmentation: gesture phrases from joint angles, and intonation phrases from prosody."""
