"""Writing a plan to files. The suffix chooses the format; see `known_suffixes`."""

from asbuilt.export.registry import check_output, drawn_to_scale, export, known_suffixes, shows_points

__all__ = ["check_output", "drawn_to_scale", "export", "known_suffixes", "shows_points"]
