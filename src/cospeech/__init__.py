"""cospeech: learns which gestures go with which melody of speech, and invents fitting ones."""

from cospeech.kernels import numba_cache

__version__ = "0.1.0"

numba_cache.keep_apart()
