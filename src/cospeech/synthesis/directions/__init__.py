"""The earlier system of Sargin 2006, chapter 3: gestures of hands and head at spotted keywords and accents."""
