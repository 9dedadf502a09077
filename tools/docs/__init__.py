"""What stands in the code and in the documents is written once: tables made from the code."""
