"""The fit of the calibrated map: what to move, what to keep of it, least squares, what is seen."""
