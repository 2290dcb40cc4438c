"""What uncertain values and scatter among granules make of the results of a scene."""
