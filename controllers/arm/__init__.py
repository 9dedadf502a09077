"""The arm: sections, chambers, limits, frozen; and the tree of exceptions."""
