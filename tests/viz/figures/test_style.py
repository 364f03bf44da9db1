"""Files of figures are known by their suffix."""

from __future__ import annotations

from pathlib import Path

import pytest

from scanfab.base.errors import SettingsError
from scanfab.viz.figures.style import check_plot_file


@pytest.mark.parametrize(
    ("name", "message"),
    [("x.docx", "not as .docx"), ("x", "without a suffix"), ("no/x.png", "there is no folder")],
)
def test_files_that_cannot_be_written_are_told_before(tmp_path, name, message):
    with pytest.raises(SettingsError, match=message):
        check_plot_file(tmp_path / name)
    check_plot_file(Path(tmp_path / "x.PNG"))
