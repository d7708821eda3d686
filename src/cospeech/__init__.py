"""cospeech: learns which gestures go with which melody of speech, and invents fitting ones."""

from cospeech import compiled

__version__ = "0.1.0"

compiled.keep_apart()
