"""What all figures share: style, colours that the colour-blind can tell apart, files."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING, Any

from scanfab.errors import SettingsError
from scanfab.writers.files import check_folder, whole_file

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

__all__ = [
    "COLOURS",
    "DPI",
    "LOOKS",
    "PLOT_FORMATS",
    "check_plot_file",
    "new_figure",
    "plain",
    "save_figure",
]

PLOT_FORMATS = {
    ".png": "pixels, 300 per inch",
    ".svg": "vectors, for pages of the web and for editing",
    ".pdf": "vectors, for print",
}

# pixels an inch, also of coloured disks in files of vectors
DPI = 300

# of Okabe and Ito (2008); each variant also has a marker and a line of its own
COLOURS = {
    "blue": "#0072B2",
    "orange": "#E69F00",
    "vermilion": "#D55E00",
    "green": "#009E73",
    "purple": "#CC79A7",
    "sky": "#56B4E9",
    "black": "#000000",
}

LOOKS: dict[str, dict[str, Any]] = {
    "a": {"color": COLOURS["blue"], "marker": "o", "ls": "-"},
    "b": {"color": COLOURS["orange"], "marker": "s", "ls": "--"},
    "c": {"color": COLOURS["vermilion"], "marker": "^", "ls": "-"},
    "d": {"color": COLOURS["green"], "marker": "D", "ls": "--"},
}

# sized for print: one column is 3.4 inches wide, two are 7
STYLE: Any = {
    "font.size": 8,
    "axes.labelsize": 8,
    "axes.titlesize": 8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.linewidth": 0.7,
    "xtick.labelsize": 7,
    "ytick.labelsize": 7,
    "legend.fontsize": 7,
    "legend.frameon": False,
    "lines.linewidth": 1.1,
    "lines.markersize": 3.5,
    "errorbar.capsize": 1.5,
    # the same input gives the same bytes
    "svg.hashsalt": "scanfab",
    # whole fonts, as publishers want them
    "pdf.fonttype": 42,
}


def check_plot_file(path: Path) -> None:
    """SettingsError if no figure can be written to a file of this name."""
    if path.suffix.lower() not in PLOT_FORMATS:
        raise SettingsError(
            f"{path}: figures can be written as {', '.join(PLOT_FORMATS)}, "
            f"not as {path.suffix or 'a file without a suffix'}"
        )
    check_folder(path)


@contextmanager
def new_figure(width: float, height: float) -> Iterator[Figure]:
    """A figure of so many inches in the common style, drawn and saved inside the block."""
    import matplotlib as mpl
    from matplotlib.figure import Figure

    # whatever matplotlibrc the user has
    with mpl.rc_context():
        mpl.rcdefaults()
        mpl.rcParams.update(STYLE)
        yield Figure(figsize=(width, height), layout="constrained")


def save_figure(figure: Figure, path: Path, dpi: int = DPI) -> None:
    """Write PNG, SVG or PDF, by the suffix; the file is complete or untouched."""
    kind = path.suffix.lower().lstrip(".")
    dates = {"png": {}, "svg": {"Date": None}, "pdf": {"CreationDate": None}}
    # in memory first: where the disk is full, the writer of PDF fails with an error of another kind
    drawn = BytesIO()
    figure.savefig(drawn, format=kind, dpi=dpi, metadata=dates[kind])
    with whole_file(path) as part:
        part.write_bytes(drawn.getbuffer())


def plain(text: str) -> str:
    """A text from a file as a label: a dollar would start a formula."""
    return text.replace("$", r"\$")


def widen(axes: Axes, smallest: float) -> None:
    """Make the y axis span at least this much, so that noise does not look like a signal."""
    low, high = axes.get_ylim()
    if high - low < smallest:
        middle = 0.5 * (low + high)
        axes.set_ylim(middle - 0.5 * smallest, middle + 0.5 * smallest)
