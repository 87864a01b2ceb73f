"""Files that a run which is killed leaves as they were, or not at all."""

from __future__ import annotations

import os
import tempfile
from pathlib import Path


def require_folder(folder: str) -> None:
    """A folder that can be written to."""
    try:
        Path(folder).mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryFile(dir=folder):
            pass
    except OSError as error:
        raise ValueError(f"{folder}: {error.strerror}; expected a folder to write to") from None


def write(path: Path, text: str) -> str:
    """Returns the path as text."""
    path.parent.mkdir(parents=True, exist_ok=True)
    temporary = path.with_name(f".{path.name}.{os.getpid()}")
    temporary.write_text(text, encoding="utf-8")
    temporary.replace(path)
    return str(path)
