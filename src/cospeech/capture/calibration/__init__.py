"""From films of a laser or a board, or from a file, to the cameras of the rig."""
