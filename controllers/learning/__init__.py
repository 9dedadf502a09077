"""Learning by repeating: the feed-forward of the next trial, from the error of those before."""
