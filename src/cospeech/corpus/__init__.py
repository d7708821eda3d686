"""Corpus: adapters through which recordings of any making enter as our tables, and labels go out and come back."""
