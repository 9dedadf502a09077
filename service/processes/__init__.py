"""What every process has in common: pipes, slots, children, priority, usage."""
