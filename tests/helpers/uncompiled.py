"""Kernels as plain Python, in a process of their own."""

import os
import subprocess
import sys
from pathlib import Path


def run_uncompiled(code):
    """Run Python code in a process without the compiler; it must end well."""
    done = subprocess.run(
        [sys.executable, "-c", code],
        env={**os.environ, "NUMBA_DISABLE_JIT": "1"},
        cwd=Path(__file__).parents[2],
        capture_output=True,
        text=True,
        timeout=300,
        check=False,
    )
    assert done.returncode == 0, done.stderr
