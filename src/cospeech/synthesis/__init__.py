"""Synthesis systems: from the speech of a record to its gesture phrases or its motion.

Each system is a sub-package with a declaration (``declaration.System``), which is registered as an entry point, and a
method (``interface.Method``).
"""
