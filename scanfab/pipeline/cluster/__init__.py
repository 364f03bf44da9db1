"""One table by many machines: the parts of job arrays, and workers that frames are sent to."""
