"""Fitting: from marker positions to joint angles."""
