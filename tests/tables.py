"""Rows of fabric tables with known curves, for tests of what reads tables."""

from __future__ import annotations

from typing import Any

STRAIN = (0.0, 0.01, 0.02, 0.03, 0.04)
VOID = (0.01, -0.02, -0.05, -0.04, -0.03)
CONTACT = (0.02, -0.05, -0.09, -0.1, -0.06)


def curve(source: str = "one", variant: str = "c", factor: float = 1.0) -> list[dict[str, Any]]:
    """Rows of one source and variant with the columns that a comparison needs."""
    return [
        {
            "source": source,
            "frame": frame,
            "strain": strain,
            "variant": variant,
            "alpha_vs_axial": factor * void,
            "alpha_c_axial": contact,
            "alpha_vs_axial_se": 3e-4,
        }
        for frame, (strain, void, contact) in enumerate(zip(STRAIN, VOID, CONTACT, strict=True))
    ]
