"""Foreign file formats, read and written."""
