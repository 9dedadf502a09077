"""The models that the paper builds on and argues with, behind one interface."""
