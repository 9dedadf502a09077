"""One step of the commanded chambers: the problem, the two laws, the safe step."""
