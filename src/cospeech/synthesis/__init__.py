"""Synthesis systems: from the speech of a record to its gesture phrases or its motion.

Each system lives in a sub-package with its declaration (``declaration.System``), which is registered as an entry
point, and its method (``interface.Method``).
"""
