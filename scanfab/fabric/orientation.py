"""The major axes of void and contact fabric, and the angle between them: are they coaxial?"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from scanfab.base.column import Column
from scanfab.fabric.tensor import FabricTensor

if TYPE_CHECKING:
    from scanfab.fabric.measured import Measured


def _axis_columns(prefix: str, what: str) -> tuple[Column, ...]:
    meaning = f"direction of the {what}'s largest principal value, a unit vector"
    return tuple(
        Column(f"{prefix}_axis_{name}", float, "", f"{name} of the {meaning}") for name in "xyz"
    )


def _axis_values(prefix: str, tensor: FabricTensor | None) -> dict[str, float | None]:
    axis = [None] * 3 if tensor is None else tensor.major_axis.tolist()
    return {f"{prefix}_axis_{name}": one for name, one in zip("xyz", axis, strict=True)}


class Orientation:
    """The columns of the major axes."""

    columns = (
        *_axis_columns("gvs", "void fabric"),
        *_axis_columns("gc", "contact fabric"),
        Column(
            "coaxiality_deg",
            float,
            "degrees",
            "angle between the major axes of void and contact fabric, 0 to 90",
        ),
    )

    def values(self, measured: Measured) -> dict[str, Any]:
        """Of what there is: an angle needs both fabrics."""
        void = measured.void.tensor if measured.void else None
        contact = measured.contact
        return {
            **_axis_values("gvs", void),
            **_axis_values("gc", contact),
            "coaxiality_deg": void.angle_to(contact) if void and contact else None,
        }
