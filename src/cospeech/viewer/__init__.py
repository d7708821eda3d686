"""The 3D viewer: a page that shows moving bodies with sound, which works offline from a file."""
