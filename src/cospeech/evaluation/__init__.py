"""Scores: how well synthesised phrases and motion resemble the actual ones, and how sure that is."""
