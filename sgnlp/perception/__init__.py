"""From camera data to an observation.

Files and arrays come in: clouds, depth images, masks, cameras. An `Observation` goes out: clean points with the camera
of each, the table's height, and notes on all that was assumed. It imports only from `base`.
"""
