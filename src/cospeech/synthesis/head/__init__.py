"""Head gestures driven by prosody (Sargin 2006, chapter 4)."""

from cospeech.synthesis.declaration import System

SYSTEMS: tuple[System, ...] = ()
