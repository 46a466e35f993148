"""From the model to the image, and back to the pose of the cameras."""
