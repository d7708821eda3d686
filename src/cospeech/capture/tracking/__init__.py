"""From films to markers in every view and in space."""
