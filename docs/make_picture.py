"""Draw docs/picture.png: scan lines through a slice, and what a triaxial test gives."""

from __future__ import annotations

from pathlib import Path

import matplotlib as mpl
import numpy as np

import scanfab

mpl.use("Agg")
from matplotlib import pyplot as plt
from matplotlib.collections import LineCollection, PatchCollection
from matplotlib.patches import Circle

HERE = Path(__file__).parent
SAMPLE = HERE.parent / "sample_data" / "yade_triaxial"
# colours of Okabe and Ito, which the colour-blind can tell apart
BLUE, ORANGE, GREEN, PURPLE = "#0072B2", "#D55E00", "#009E73", "#CC79A7"


def gaps(x: np.ndarray, radius: np.ndarray, z: float) -> list[tuple[float, float]]:
    """Void segments of the horizontal line at height z through circles (x, 0, radius)."""
    half = np.sqrt(np.maximum(radius**2 - (x[:, 1] - z) ** 2, 0))
    chords = sorted((c - h, c + h) for c, h in zip(x[:, 0], half, strict=True) if h > 0)
    found, end = [], None
    for start, stop in chords:
        if end is not None and start > end:
            found.append((end, start))
        end = stop if end is None else max(end, stop)
    return found


def draw_slice(axes: plt.Axes, packing: scanfab.Packing) -> None:
    """The plane y = 0 with lines inclined by 30 degrees; lengths in grains' smallest radii."""
    grains = packing.columns["mask"] == 1
    unit = packing.radius[grains].min()
    position, radius = packing.position[grains] / unit, packing.radius[grains] / unit
    cut = radius**2 - position[:, 1] ** 2
    circles, cut_radius = position[cut > 0][:, [0, 2]], np.sqrt(cut[cut > 0])
    angle = np.radians(30)
    turn = np.array([[np.cos(angle), np.sin(angle)], [-np.sin(angle), np.cos(angle)]])
    kept, dropped = [], []
    for z in np.arange(-18.0, 18.1, 2.0):
        for a, b in gaps(circles @ turn.T, cut_radius, z):
            ends = np.array([[a, z], [b, z]]) @ turn
            (kept if b - a >= 1 else dropped).append(ends)
    patches = [Circle(tuple(c), r) for c, r in zip(circles, cut_radius, strict=True)]
    axes.add_collection(PatchCollection(patches, facecolor="0.85", edgecolor="0.6", lw=0.4))
    axes.add_collection(LineCollection(dropped, colors=ORANGE, lw=1.2, label="shorter: dropped"))
    axes.add_collection(
        LineCollection(kept, colors=BLUE, lw=1.6, label="void segment ≥ $r_{min}$: kept")
    )
    axes.set(aspect="equal", xlim=(-25, 25), ylim=(-23, 29), xlabel="x / $r_{min}$")
    axes.set(ylabel="z / $r_{min}$", title="Scan lines of one direction, in a slice")
    axes.legend(loc="upper right", fontsize=8, framealpha=0.95)


def draw_curves(axes: plt.Axes, table: scanfab.Table) -> None:
    """α_vs of the RV and α_c against strain."""
    rv = table.select(variant="c")
    strain = 100 * rv["strain"]
    axes.errorbar(
        strain,
        1000 * rv["alpha_vs_axial"],
        yerr=2000 * rv["alpha_vs_axial_se"],
        color=BLUE,
        marker="o",
        ms=4,
        capsize=3,
        label=r"void fabric $\alpha_{vs}$ (bars: 2 s.e. of the scan)",
    )
    axes.set(xlabel="axial strain in %", ylabel=r"$10^3\,\alpha_{vs}$", ylim=(-1.5, 15))
    axes.set_title("Triaxial compression, representative volume")
    other = axes.twinx()
    other.plot(
        strain,
        1000 * rv["alpha_c_axial"],
        color=ORANGE,
        marker="s",
        ms=4,
        ls="--",
        label=r"contact fabric $\alpha_c$",
    )
    other.set(ylabel=r"$10^3\,\alpha_c$", ylim=(-15, 150))
    lines = [*axes.get_legend_handles_labels()[0], *other.get_legend_handles_labels()[0]]
    axes.legend(lines, [line.get_label() for line in lines], loc="lower right", fontsize=8)


def main() -> None:
    """Compute the sample and draw."""
    figure, (left, right) = plt.subplots(1, 2, figsize=(10, 4.4), layout="constrained")
    series = scanfab.read_series(sorted(SAMPLE.glob("triaxial-*.vtk.gz")))
    draw_slice(left, next(iter(series)).read())
    draw_curves(right, scanfab.compute(series, variants="c", boundary="mask=3"))
    figure.savefig(HERE / "picture.png", dpi=110)


if __name__ == "__main__":
    main()
