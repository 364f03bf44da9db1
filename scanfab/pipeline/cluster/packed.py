"""A function to be sent away, apart from the solids that it scans, which are sent once."""

from __future__ import annotations

import io
import pickle
from dataclasses import dataclass
from typing import Any

from scanfab.scan.solids import Solids


@dataclass(frozen=True)
class Packed:
    """A pickle, and the heavy objects that it names."""

    light: bytes
    heavy: dict[str, Any]

    @classmethod
    def of(cls, what: Any) -> Packed:
        """Anything that can be pickled."""
        stream = io.BytesIO()
        pickler = _Pickler(stream)
        pickler.dump(what)
        return cls(stream.getvalue(), pickler.heavy)


class _Pickler(pickle.Pickler):
    def __init__(self, stream: io.BytesIO) -> None:
        super().__init__(stream, protocol=5)
        self.heavy: dict[str, Any] = {}

    def persistent_id(self, found: Any) -> str | None:
        """The name of what is sent by itself."""
        if not isinstance(found, Solids):
            return None
        name = str(id(found))
        self.heavy[name] = found
        return name


class _Unpickler(pickle.Unpickler):
    def __init__(self, light: bytes, heavy: dict[str, Any]) -> None:
        super().__init__(io.BytesIO(light))
        self.heavy = heavy

    def persistent_load(self, name: Any) -> Any:
        """What came by itself."""
        return self.heavy[name]


def unpacked(light: bytes, heavy: dict[str, Any]) -> Any:
    """What was packed, with the heavy objects by name."""
    return _Unpickler(light, heavy).load()
