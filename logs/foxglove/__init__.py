"""The arm in Foxglove's messages: frames and body."""
