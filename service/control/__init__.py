"""The control process: the tick, its deadlines, its steering."""
