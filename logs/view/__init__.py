"""What Rerun shows: one function for live and for replay."""
