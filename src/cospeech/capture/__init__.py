"""Motion capture: from films of an actor wearing markers, or from another system's markers, to joint angles."""
