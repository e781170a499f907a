"""Writing a plan to files. The suffix chooses the format; see `known_suffixes`."""

from asbuilt.export.registry import check_output, export, known_suffixes

__all__ = ["check_output", "export", "known_suffixes"]
