"""When a render writes checkpoints, and whether it resumes from one."""

from __future__ import annotations

from dataclasses import dataclass

from ...file_names import StrPath
from ...option_fields import option


@dataclass(frozen=True)
class CheckpointPolicy:
    """When a render writes checkpoints, and whether it resumes from one (docs/checkpoints.md)."""

    checkpoint: StrPath | None = option(
        None, "Save the state there regularly, so that a render can resume; FILE~ is the previous one."
    )
    resume: bool = option(
        False, "Resume from the checkpoint, with the spp planned then; start afresh if it does not exist yet."
    )
    checkpoint_seconds: float = option(
        30.0, "Time between checkpoints; longer if they would take more than 2 % of the time."
    )
