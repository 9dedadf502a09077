"""Whether a target is reached or out of reach, and the way round inside the workspace."""
