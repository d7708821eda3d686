"""Calibration of the camera rig from films of a laser spot or a ChArUco board, or from a camera file."""
