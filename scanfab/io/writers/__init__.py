"""Writers of packings, a format a file."""
