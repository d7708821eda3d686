"""The virtual studio: synthetic actors with known gesture and speech behaviour, their script, voices and motion."""
