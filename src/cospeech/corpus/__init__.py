"""Corpus: adapters that read recordings of any origin into our tables, and export and import annotations."""
