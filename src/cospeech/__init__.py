"""cospeech: learns which gestures go with which melody of speech, and invents fitting ones."""

__version__ = "0.1.0"
