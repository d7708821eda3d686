"""Capture: from films of an actor with markers, or from the markers of another system, to joint angles."""
