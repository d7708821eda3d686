"""Lips: from the film of a talking face to coefficients of the lip region, and these at the rate of the sound."""

from cospeech.identity.lips.interpolation import at_rate as at_rate
