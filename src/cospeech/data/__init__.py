"""Tables, segments and the other data that every room uses."""
