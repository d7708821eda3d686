"""From markers to joint angles."""
