"""The MCAP file: written in parts, and mended after a crash."""
