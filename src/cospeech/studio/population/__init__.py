"""A population of virtual speakers who say names, for audio-visual speaker identification (Sargin 2006, 2.4)."""
