"""
Compute the antipodal spherical designs of scanfab/scan/designs.csv; prints the table.

N axes with equal weights integrate every polynomial to the odd degree t: odd ones vanish by
symmetry, and the sums of the even spherical harmonics are made to vanish by Gauss-Newton steps from
seeded random starts. N = ceil((t² + t + 4) / 4), or a few more where no design is found with that.
"""

from __future__ import annotations

import numpy as np
from scipy.optimize import least_squares
from scipy.special import sph_harm_y_all

STARTS = 120


def sums(angles: np.ndarray, degree: int) -> tuple[np.ndarray, np.ndarray]:
    """Means of the real even harmonics of order 2 to degree - 1, and their derivatives."""
    theta, phi = angles.reshape(2, -1)
    harmonics, slopes = sph_harm_y_all(degree - 1, degree - 1, theta, phi, diff_n=1)
    values, derivatives = [], []
    for n in range(2, degree, 2):
        for m in range(n + 1):
            for part in (np.real, np.imag)[: 1 + (m > 0)]:
                values.append(part(harmonics[n, m]).mean())
                both = np.concatenate([slopes[n, m, :, 0], slopes[n, m, :, 1]])
                derivatives.append(part(both) / theta.size)
    return np.array(values), np.array(derivatives)


def to_axes(angles: np.ndarray) -> np.ndarray:
    """Unit vectors from the polar angles and the azimuths, one after the other."""
    theta, phi = angles.reshape(2, -1)
    flat = np.sin(theta)
    return np.column_stack([flat * np.cos(phi), flat * np.sin(phi), np.cos(theta)])


def to_angles(axes: np.ndarray) -> np.ndarray:
    """The inverse, with polar angles in [0, pi]."""
    azimuth = np.arctan2(axes[:, 1], axes[:, 0])
    return np.concatenate([np.arccos(np.clip(axes[:, 2], -1, 1)), azimuth])


def solve(degree: int) -> np.ndarray:
    """The axes of the design of one degree, shape (N, 3)."""
    fewest = -(-(degree * degree + degree + 4) // 4)
    for start in range(STARTS):
        count = fewest + start // 30
        random = np.random.default_rng([degree, start])
        z, phi = random.uniform(0, 1, count), random.uniform(-np.pi, np.pi, count)
        found = least_squares(
            lambda a: sums(a, degree)[0],
            np.concatenate([np.arccos(z), phi]),
            jac=lambda a: sums(a, degree)[1],
            max_nfev=200,
        )
        # SciPy's harmonics hold for theta in [0, pi]: an angle that has left it starts again there
        angles = to_angles(to_axes(found.x))
        for _ in range(6):  # the last digits
            values, slopes = sums(angles, degree)
            angles = angles - np.linalg.lstsq(slopes, values)[0]
        axes = to_axes(angles)
        if np.abs(sums(to_angles(axes), degree)[0]).max() < 2e-15:
            return axes
    raise RuntimeError(f"no design of degree {degree} found in {STARTS} starts")


if __name__ == "__main__":
    print(
        "# Antipodal spherical designs: degree, x, y, z; one axis a line, equal weights "
        "(docs/make/designs.py)"
    )
    for degree in range(3, 22, 2):
        for axis in solve(degree):
            print(degree, *(repr(float(x)) for x in axis), sep=",")
