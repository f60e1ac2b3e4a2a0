"""The storage files of a bag, with or without metadata.yaml, and finding bags in a folder."""

from __future__ import annotations

import re
import shlex
from collections import Counter
from collections.abc import Collection, Iterator
from dataclasses import dataclass
from pathlib import Path

from fjr_kit.errors import InputError

from .blocks import MEND, Block
from .mcap_blocks import McapFile
from .mcap_summary import Contents, describe, survey
from .metadata import METADATA, BagMetadata, TopicMetadata, read_metadata, storage_files
from .sqlite import SqliteFile

MCAP, SQLITE = ".mcap", ".db3"
_STORAGE = {MCAP: "mcap", SQLITE: "sqlite3"}
_NUMBER = re.compile(r"(.*?)(?:_([0-9]{1,9}))?")
ROS_1 = ".bag"
"""How the name of a bag of ROS 1 ends."""


@dataclass(frozen=True)
class BagFiles:
    """A bag's files and what is said of their content.

    Attributes:
        files: the storage files in the order of recording.
        metadata: of metadata.yaml, or None if the bag has none.
        described: the topics, of which some may have no message.
        counts: number of messages that each topic must have.
        duration_ns: time that the recording took.
        counted: where the counts come from, as '... says'.
        notes: sentences on what is missing.
        unclosed: whether a file was never closed, so that topics may end one before the other.
    """

    files: list[Path]
    metadata: BagMetadata | None
    described: list[TopicMetadata]
    counts: dict[str, int]
    counted: str
    duration_ns: int
    notes: tuple[str, ...] = ()
    unclosed: bool = False

    @property
    def topics(self) -> dict[str, str]:
        """Type of each topic by its name."""
        return {topic.name: topic.type for topic in self.described}

    def refuse_cut(self) -> None:
        """Raise InputError if a file of a bag with metadata.yaml was cut off."""
        for file in self.files if self.metadata is not None else []:
            if _survey(file, _is_sqlite(self.metadata, file)).note is not None:
                raise InputError(f"{file}: the file ends early: it was cut off; {MEND}.")

    def blocks(self, wanted: Collection[str]) -> Iterator[Block]:
        """Yield the messages of all files; those of topics that are not wanted may be unread.

        Raises:
            InputError: a file is damaged.
        """
        for file in self.files:
            if _is_sqlite(self.metadata, file):
                yield from SqliteFile(file).blocks(wanted)
            else:
                yield from McapFile(file, unclosed=self.metadata is None).blocks()


def _is_sqlite(metadata: BagMetadata | None, file: Path) -> bool:
    if metadata is not None:
        return metadata.storage_identifier == "sqlite3"
    return file.suffix == SQLITE


def bag_files(bag: Path) -> BagFiles:
    """Return the files of a bag folder, or of a storage file by itself.

    Without metadata.yaml, as Foxglove and crashed recorders leave a bag, topics and counts come
    from the files themselves.

    Raises:
        InputError: there is no bag, or it is damaged.
    """
    try:
        if bag.is_file() and bag.suffix in _STORAGE:
            return _without_metadata(bag, [bag])
        if bag.is_dir() and not (bag / METADATA).exists():
            files = _stored(bag)
            if files:
                return _without_metadata(bag, files)
    except OSError as error:
        raise InputError(f"{bag}: cannot be read ({error.strerror}).") from None
    metadata = read_metadata(bag)
    files = storage_files(bag, metadata)
    duration = metadata.duration.nanoseconds
    return BagFiles(files, metadata, metadata.topics, metadata.counts, f"{METADATA} says", duration)


def _without_metadata(bag: Path, files: list[Path]) -> BagFiles:
    if len({file.suffix for file in files}) > 1 or len({_series(file) for file in files}) > 1:
        names = ", ".join(file.name for file in files[:4])
        raise InputError(
            f"{bag}: holds several recordings ({names}) without {METADATA}; name one of the files."
        )
    counts: Counter[str] = Counter()
    why = f"{METADATA} is missing" if bag.is_dir() else f"is read without {METADATA}"
    notes = [f"{bag.name}: {why}; topics and counts are those of the file itself."]
    contents = [_survey(file, file.suffix == SQLITE) for file in files]
    for found in contents:
        counts.update(found.counts)
        if found.note is not None:
            notes.append(f"{bag.name}: {found.note}")
    if not counts:
        raise InputError(f"{bag}: holds no message; {MEND}.")
    return BagFiles(
        files,
        None,
        [topic for found in contents for topic in found.topics],
        counts,
        "its summary says",
        max(found.last_ns for found in contents) - min(found.first_ns for found in contents),
        tuple(notes),
        any(found.note is not None for found in contents),
    )


def _survey(file: Path, is_sqlite: bool) -> Contents:
    if not is_sqlite:
        return survey(file)
    counts: Counter[str] = Counter()
    topics, first_ns, last_ns = SqliteFile(file).survey()
    for topic, count in topics:
        counts[topic.name] += count
    return Contents([describe(topic) for topic, _ in topics], +counts, first_ns, last_ns)


def _stored(folder: Path) -> list[Path]:
    """Return the storage files of a folder in the order of their numbers."""
    files = [file for file in folder.iterdir() if file.suffix in _STORAGE and file.is_file()]
    return sorted(files, key=lambda file: (_series(file), _number(file), file.name))


def _series(file: Path) -> str:
    """Return the name that the files of one recording share: that of `name_0`, `name_1`."""
    match = _NUMBER.fullmatch(file.stem)
    return match[1] if match else file.stem


def _number(file: Path) -> int:
    match = _NUMBER.fullmatch(file.stem)
    return int(match[2] or 0) if match else 0


def find_bags(folder: Path | str) -> list[Path]:
    """Return the bags of an experiment folder, sorted by name; a bag itself gives itself.

    Hidden folders are passed over: they are bags still being written. A folder with a storage
    file but without metadata.yaml is a bag too, unless it holds files of several recordings: then
    each of these is one.

    Raises:
        InputError: the folder does not exist or holds no bag.
    """
    folder = Path(folder)
    try:
        if folder.suffix in _STORAGE and folder.is_file():
            return [folder]
        if folder.suffix == ROS_1 and folder.is_file():
            raise InputError(of_ros_1(folder))
        bags = _bags_of(folder)
        if bags != [folder]:
            children = (path for path in folder.iterdir() if not path.name.startswith("."))
            folders = (path for path in children if path.is_dir())
            bags = sorted([*bags, *(bag for path in folders for bag in _bags_of(path))])
    except OSError as error:
        raise InputError(f"{folder}: is not a readable folder ({error.strerror}).") from None
    if not bags:
        old = sorted(folder.glob(f"*{ROS_1}"))
        if old:
            raise InputError(of_ros_1(old[0]))
        raise InputError(f"{folder}: holds no bag; name a bag or a folder of bags.")
    return bags


def of_ros_1(file: Path) -> str:
    """Return what to do with a bag of ROS 1."""
    source = shlex.quote(str(file))
    return (
        f"{file}: is a bag of ROS 1; rosbags-convert --src {source} --dst FOLDER, which is "
        "installed with fjr, makes one of ROS 2."
    )


def _bags_of(folder: Path) -> list[Path]:
    """Return the folder if it is a bag; else the files in it that are bags by themselves."""
    if (folder / METADATA).exists():
        return [folder]
    files = _stored(folder)
    one_recording = len({(_series(file), file.suffix) for file in files}) == 1
    return [folder] if one_recording else files
