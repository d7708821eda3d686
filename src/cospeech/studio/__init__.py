"""The virtual studio: a cast with planted gesture and speech behaviour, its script, its voice and its movement."""
