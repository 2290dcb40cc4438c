"""Effects of uncertain values, and of scatter among granules, on the results of a scene."""
