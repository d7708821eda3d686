"""Speech: from sound to prosody frames."""
