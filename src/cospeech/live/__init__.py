"""A model that gestures while somebody speaks: sound in, motion out.

Sound passes through these modules in this order: ``sound`` (where it comes from), ``hearing`` (prosody frames and
syllables), ``performing`` (a trained system, or one that decodes again at every hop) with ``phrases`` (motion of
gesture phrases), and the outputs ``vmc`` and ``recording``. The ``engine`` connects them.
"""
