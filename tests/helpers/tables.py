"""Rows of fabric tables with known curves, for tests of what reads tables."""

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


def sheared(source: str = "shear") -> list[dict[str, Any]]:
    """Rows of a cell in simple shear: its principal axes are not the loading axis."""
    return [
        {
            **row,
            "strain": 0.0,
            "shear_strain": 10 * row["strain"],
            "alpha_vs_axial": 1e-3 * place,
            "alpha_c_axial": 1e-3 * place,
            "alpha_vs": abs(row["alpha_vs_axial"]),
            "alpha_c": abs(row["alpha_c_axial"]),
            "alpha_c_axial_se": 1e-3,
            "coaxiality_deg": 9.0 * place,
        }
        for place, row in enumerate(curve(source))
    ]
