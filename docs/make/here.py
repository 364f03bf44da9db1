"""Let a notebook of the site work in a folder of its own, with the sample data in it."""

import os
import tempfile
from pathlib import Path

samples = Path(__file__).parents[2] / "sample_data"
os.chdir(tempfile.mkdtemp())
Path("sample_data").symlink_to(samples)
