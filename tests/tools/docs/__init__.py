"""Tests of what writes tables into the documents."""
