"""Tasks: what the tip or the chambers should do, as a wanted rate and its Jacobian."""
