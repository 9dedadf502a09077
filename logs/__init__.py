"""What is written down and shown: messages, ring, recorder, reader, replay and view."""
