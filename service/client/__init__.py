"""The user's own program: the client and the targets it sends."""
