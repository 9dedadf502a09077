"""The set of positions that the tip can take: boundary, volume, nearest point."""
