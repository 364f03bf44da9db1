"""Maps: the fabric block by block."""
