"""One frame: the common table of spheres and contacts, and what can be told from it alone."""
