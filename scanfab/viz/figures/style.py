"""What all figures share: style, colours that the colour-blind can tell apart, files."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from string import ascii_lowercase
from typing import TYPE_CHECKING, Any

import numpy as np

from scanfab.base.errors import SettingsError
from scanfab.base.files import check_folder
from scanfab.base.typing import FloatArray

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure


PLOT_FORMATS = (".png", ".svg", ".pdf")

# Pixels an inch, also of the coloured disks in vector files.
DPI = 300

# Colours of Okabe and Ito (2008). Each variant also has its own marker and line.
COLOURS = {
    "blue": "#0072B2",
    "orange": "#E69F00",
    "vermilion": "#D55E00",
    "green": "#009E73",
    "purple": "#CC79A7",
    "sky": "#56B4E9",
    "black": "#000000",
}

# Variants without rattlers have larger open markers, which are seen behind those of their twins.
LOOKS: dict[str, dict[str, Any]] = {
    "a": {"color": COLOURS["blue"], "marker": "o", "ls": "-"},
    "b": {"color": COLOURS["orange"], "marker": "s", "ls": "--", "mfc": "white", "ms": 5.5},
    "c": {"color": COLOURS["vermilion"], "marker": "^", "ls": "-"},
    "d": {"color": COLOURS["green"], "marker": "D", "ls": "--", "mfc": "white", "ms": 5.5},
}

COLOURS_OF_MANY = ("blue", "vermilion", "green", "purple", "orange", "sky", "black")
LINES = ("-", "--", "-.", ":")
# Looks of curves that differ by source, size of the RV or polar angle; the second half is open.
MANY_LOOKS: tuple[dict[str, Any], ...] = tuple(
    {"color": COLOURS[colour], "marker": marker, "ls": LINES[(place + turn) % 4], **more}
    for turn, more in enumerate(({}, {"mfc": "white", "ms": 5.5}))
    for place, (colour, marker) in enumerate(zip(COLOURS_OF_MANY, "o^DsvPX", strict=True))
)
# Looks of the first and the last frame in one panel.
FRAME_LOOKS: tuple[dict[str, Any], ...] = (
    {"color": COLOURS["blue"], "marker": "o", "ls": "--", "markerfacecolor": "white"},
    {"color": COLOURS["vermilion"], "marker": "^", "ls": "-"},
)

# Titles of panels that show distributions over directions.
DIRECTIONAL = {"voids": "mean void length", "contacts": "contact normals"}

# Names of the table's columns, the same in every figure.
VOID, CONTACT = r"$\alpha_{vs}$", r"$\alpha_{c}$"
NAMES = {
    "alpha_vs_axial": f"{VOID}, axial",
    "alpha_c_axial": f"{CONTACT}, axial",
    "alpha_vs": f"{VOID}, intensity",
    "alpha_c": f"{CONTACT}, intensity",
}
LABELS = {
    column: (r"void  $10^3\,$" if VOID in name else r"contacts  $10^2\,$") + name
    for column, name in NAMES.items()
}

# A figure of one panel is as wide as a column of a journal, others one and a half columns, so that
# they are legible on a phone.
COLUMN, WIDTH = 3.4, 5.4
STYLE: Any = {
    "font.size": 9,
    "axes.labelsize": 9,
    "axes.titlesize": 9,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.labelsize": 8,
    "ytick.labelsize": 8,
    "legend.fontsize": 8,
    "legend.title_fontsize": 8,
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "lines.markersize": 3.5,
    "errorbar.capsize": 1.5,
    # the same input gives the same names inside the file
    "svg.hashsalt": "scanfab",
    # whole fonts, as publishers want them
    "pdf.fonttype": 42,
}


def check_plot_file(path: Path) -> None:
    """SettingsError if no figure can be written to a file of this name."""
    if path.suffix.lower() not in PLOT_FORMATS:
        known, found = ", ".join(PLOT_FORMATS), path.suffix or "a file without a suffix"
        raise SettingsError(f"{path}: figures can be written as {known}, not as {found}")
    check_folder(path)


@contextmanager
def new_figure(width: float, height: float) -> Iterator[Figure]:
    """A figure of so many inches in the common style, drawn and saved inside the block."""
    from matplotlib import style
    from matplotlib.figure import Figure

    # do not depend on the user's matplotlibrc
    with style.context(STYLE, after_reset=True):
        yield Figure(figsize=(width, height), layout="constrained")


def figure_bytes(figure: Figure, kind: str, dpi: int = DPI) -> bytes:
    """A figure as ``png``, ``svg`` or ``pdf``; no file is made."""
    # no date, so that the same input gives the same figure
    date: Any = {"svg": {"Date": None}, "pdf": {"CreationDate": None}}.get(kind)
    drawn = BytesIO()
    figure.savefig(drawn, format=kind, dpi=dpi, metadata=date)
    return drawn.getvalue()


def rounded_down(value: float) -> float:
    """1, 2 or 5 times a power of ten, not above the value."""
    power = 10.0 ** np.floor(np.log10(value))
    return float(max(step for step in (power, 2 * power, 5 * power) if step <= value))


def plain(text: str) -> str:
    """Escape dollars in a label, which would start a formula."""
    return text.replace("$", r"\$")


def widen(axes: Axes, smallest: float) -> None:
    """
    Make the y axis span at least this much, so that noise does not look like a signal.

    It spans a ten-thousandth of its values in any case: smaller changes are rounding.
    """
    low, high = axes.get_ylim()
    smallest = max(smallest, 1e-4 * abs(low), 1e-4 * abs(high))
    if high - low < smallest:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * smallest, middle + 0.5 * smallest)


def letter(panels: Sequence[Axes]) -> None:
    """Write (a), (b) ... above the panels, before their titles; a lone panel needs no letter."""
    for axes, sign in zip(panels, ascii_lowercase, strict=False):
        if len(panels) > 1:
            axes.set_title(f"({sign}) {axes.get_title(loc='left')}".rstrip(), loc="left")


def band(axes: Axes, x: FloatArray, y: FloatArray, error: FloatArray, look: Any) -> None:
    """Shade y ± error; a single point gets a bar, as an area needs two points."""
    colour = look["color"]
    known = np.isfinite(x + y + error)
    if not known.any():
        return
    axes.fill_between(x, y - error, y + error, color=colour, alpha=0.15, lw=0)
    beside = np.concatenate([[False], known, [False]])
    alone = known & ~beside[:-2] & ~beside[2:]
    if alone.any():
        low, high = (y - error)[alone], (y + error)[alone]
        axes.vlines(x[alone], low, high, color=colour, alpha=0.3, lw=5, zorder=1)
