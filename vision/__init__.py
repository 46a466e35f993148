"""From stereo pictures to arcs, regions, matches and the pose of the cameras."""
