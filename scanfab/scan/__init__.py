"""Scan lines through spheres, as sums over their void segments: arrays in, sums out."""
