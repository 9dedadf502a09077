"""What is written down and shown: messages, rings, recorder, reader, view. No Zenoh."""
