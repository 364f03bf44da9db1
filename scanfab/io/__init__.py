"""From files, as users name them, to series of frames."""
