"""Figures as another package would offer them: one of a table, one of frames."""

from __future__ import annotations

from scanfab.viz.figures.figure import Figure, FrameFigure


class Rattlers(Figure):
    """Rattlers over the frames."""

    columns = ("frame", "variant", "rattlers")

    def draw(self, ax):
        for variant in sorted(set(self.data["variant"])):
            rows = self.data.select(variant=variant)
            ax.plot(rows["frame"], rows["rattlers"], label=variant, gid="rattlers")
        ax.set_ylabel("rattlers")


class Contacts(FrameFigure):
    """Heights of the contact normals, a count for each frame."""

    def draw(self, ax):
        for frame in self.chosen(self.data.frames):
            ax.hist(abs(frame.normals[:, 2]), label=frame.title, gid="heights")
