"""A virtual speaker who gives route directions: sentences, voice, head and hands (Sargin 2006, 3.1)."""
