"""The gesture controller of Levine et al. 2010, which has an inference layer and a control layer.

The inference layer turns prosody into beliefs over the hidden states of gesture kinematics (section 6). The control
layer selects the motion segments that fit the beliefs and follow one another smoothly (section 7, appendix A).
"""
