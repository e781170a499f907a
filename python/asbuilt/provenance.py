"""Where evidence comes from: files, coordinate systems, what was left out."""

from __future__ import annotations

import json
from collections import Counter
from collections.abc import Iterable
from dataclasses import dataclass, fields
from typing import Any

from asbuilt.errors import InputError


@dataclass(frozen=True)
class Provenance:
    """What is known of the files behind evidence; sorted, so that their order leaves no trace.

    Attributes
    ----------
    inputs : `name`, `size` (bytes) and `checksum` of each file.
    systems : the different coordinate reference systems that their headers name.
    skipped : what was left out, one line each.
    """

    inputs: tuple[dict[str, Any], ...] = ()
    systems: tuple[str, ...] = ()
    skipped: tuple[str, ...] = ()

    @property
    def crs(self) -> str | None:
        """The coordinate reference system, if the files agree on one."""
        return self.systems[0] if len(self.systems) == 1 else None

    @classmethod
    def of_all(cls, parts: Iterable[Provenance]) -> Provenance:
        """That of several together.

        Raises
        ------
        InputError : a file is in two of them; its points would count twice.
        """
        parts = list(parts)
        inputs = sorted((entry for part in parts for entry in part.inputs), key=lambda e: (e["name"], e["checksum"]))
        checksum, times = Counter(entry["checksum"] for entry in inputs).most_common(1)[0] if inputs else ("", 0)
        if times > 1:
            one, other = [entry["name"] for entry in inputs if entry["checksum"] == checksum][:2]
            what = f"{one} came in twice" if one == other else f"{one} and {other} are the same file"
            raise InputError(f"{what} ({checksum[:23]}...); its points would count twice")
        systems = {system for part in parts for system in part.systems}
        skipped = {line for part in parts for line in part.skipped}
        return cls(tuple(inputs), tuple(sorted(systems)), tuple(sorted(skipped)))

    def to_text(self) -> str:
        """As JSON on one line; the same text for the same provenance."""
        found = {field.name: getattr(self, field.name) for field in fields(self)}
        return json.dumps(found, ensure_ascii=False, sort_keys=True, separators=(",", ":"))

    @classmethod
    def from_text(cls, text: str) -> Provenance:
        """What `to_text` wrote.

        Raises
        ------
        ValueError : it is something else.
        """
        try:
            found = json.loads(text)
            inputs = tuple(
                {"name": str(entry["name"]), "size": int(entry["size"]), "checksum": str(entry["checksum"])}
                for entry in found["inputs"]
            )
            return cls(inputs, tuple(map(str, found["systems"])), tuple(map(str, found["skipped"])))
        except (TypeError, LookupError, RecursionError) as error:
            raise ValueError("expected inputs, systems and skipped") from error
