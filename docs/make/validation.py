"""What docs/validation.md takes from the stored tables of the paper's experiment."""

from __future__ import annotations

from collections.abc import Callable
from functools import partial

import paper
from figures import DOCS

PARTS: dict[str, Callable[[], str]] = {
    **{
        part.__name__: part
        for part in (
            paper.slopes, paper.counted, paper.start_worst, paper.lagging,
            paper.normalised_worst, paper.held, paper.pooled, paper.disc_ratio,
            paper.predicted_off, paper.voids_left, paper.null_tests,
        )
    },
    "off_share": partial(paper.share_of_final, "off"),
    "lateral_share": partial(paper.share_of_final, "lateral"),
    "contact_share": lambda: paper.span(paper.at_ten("alpha_c_axial")),
    "void_share": lambda: paper.span(paper.at_ten("alpha_vs_axial")),
    "apart_8": partial(paper.apart_at, 0.08),
    **{f"left_{one}": partial(paper.left_by_ends, one / 100) for one in (8, 12, 20)},
    "stress_smooth": partial(paper.shell_shares, paper.IN_SHELL, "stress"),
    "contacts_smooth": partial(paper.shell_shares, paper.IN_SHELL, "contacts"),
    "stress_rough": partial(paper.shell_shares, ["yade_rough"], "stress"),
    "contacts_rough": partial(paper.shell_shares, ["yade_rough"], "contacts"),
    "best_cutoff_early": partial(paper.best_cutoff, 0.05),
    "best_cutoff": partial(paper.best_cutoff, 0.2),
    "order_four_contacts": partial(paper.order_four, "c", ("yade_1", "periodic_1", "biaxial_1")),
    "order_four_voids": partial(paper.order_four, "vs", ("yade_1", "periodic_1")),
    "order_four_discs": partial(paper.order_four, "vs", ["biaxial_1"]),
    "contacts_back": partial(paper.strain_back, "c"),
    "voids_back": partial(paper.strain_back, "vs"),
    "length_off": partial(paper.exact_length, 0.0),
    "length_off_dense": partial(paper.exact_length, 0.19),
}  # fmt: skip


def write_tables() -> None:
    """The long tables beside the page."""
    folder = DOCS / "tables"
    folder.mkdir(exist_ok=True)
    paper.write_slopes(folder)
