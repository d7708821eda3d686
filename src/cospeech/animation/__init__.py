"""From synthesised phrases to a moving body: unit selection, smoothing, figures, video (Özkul 2012, chapter 6)."""
