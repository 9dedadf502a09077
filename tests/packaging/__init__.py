"""The two distributions: what is in them, and that they run where only they are installed."""
