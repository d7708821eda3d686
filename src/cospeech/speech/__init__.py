"""Speech: prosody features from sound."""
