"""What functions are given: objects, or their paths."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from typing import Any, Callable, Optional, Union

from ._trundle import JointSlam, Merge, Recording, Robot, Slam

Path = Union[str, "os.PathLike[str]"]
Start = tuple[float, float, float]  # x and y [m], heading [degrees]
Runs = Union[Path, Recording, Iterable[Union[Path, Recording]]]
Map = Union[Slam, JointSlam, Merge]

_MAPS = (Slam, JointSlam, Merge)
_OBJECTS = (Recording, Robot, *_MAPS)


def recording_of(given: Union[Path, Recording]) -> Recording:
    return given if isinstance(given, Recording) else Recording(given)


def robot_of(given: Union[Path, Robot]) -> Robot:
    return given if isinstance(given, Robot) else Robot(given)


def many(given: Any) -> list[Any]:
    """One, or several of them."""
    return [given] if isinstance(given, (str, os.PathLike, *_OBJECTS)) else list(given)


def text_of(path: Optional[Path]) -> str:
    """As the program takes it: empty where there is none."""
    return "" if path is None else os.fspath(path)


@contextmanager
def given_paths() -> Iterator[Callable[[Any], list[str]]]:
    """The paths of what is given, one or several: an object that no file gives is written into a folder of its own."""
    from tempfile import TemporaryDirectory

    with TemporaryDirectory(prefix="trundle-") as folder:
        written = 0

        def path(given: Any) -> str:
            nonlocal written
            if not isinstance(given, _OBJECTS):
                return os.fspath(given)
            if isinstance(given, Recording) and given.path:
                return given.path
            written += 1
            name = given.name if isinstance(given, Recording) else given.path if isinstance(given, Robot) else "map"
            place = os.path.join(folder, str(written), os.path.basename(os.path.normpath(name)))
            given.save(place)
            return place

        yield lambda given: [] if given is None else [path(one) for one in many(given)]


def map_file(given: Any, paths: Callable[[Any], list[str]]) -> Any:
    """Of a map that was found its landmarks.csv, by `given_paths`; of a path that path."""
    return os.path.join(paths(given)[0], "landmarks.csv") if isinstance(given, _MAPS) else given
