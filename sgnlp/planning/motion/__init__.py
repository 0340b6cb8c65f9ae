"""The whole motion of a planned grasp: stand-off, straight approach, closing, squeeze, lift, with times and checks."""
