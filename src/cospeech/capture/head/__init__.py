"""Head capture: from the film of a face, in stereo or from one camera, to the pose of the head in every frame.

The method is that of Sargin 2006, section 4.1.1: face detection, skin colour, optical flow, disparity, rigid motion
and a Kalman filter. Wherever a trial showed something better, both are there and can be selected.
"""
