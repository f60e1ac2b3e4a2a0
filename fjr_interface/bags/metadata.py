"""metadata.yaml of a rosbag2 bag."""

from __future__ import annotations

from pathlib import Path, PurePosixPath
from typing import Any

from pydantic import BaseModel, ConfigDict, Field, ValidationError

from fjr_kit.errors import InputError
from fjr_kit.result_types import first_problem

from .blocks import MEND
from .plain_yaml import load_plain_yaml

METADATA = "metadata.yaml"
_MAX_METADATA = 16 * 2**20


class _Model(BaseModel):
    model_config = ConfigDict(frozen=True, extra="allow")


class TopicMetadata(_Model):
    """Name, type, serialization and offered QoS profiles (parsed or YAML) of a topic."""

    name: str
    type: str
    serialization_format: str = "cdr"
    offered_qos_profiles: list[Any] | str = ""


class TopicCount(_Model):
    """A topic and its number of messages."""

    topic_metadata: TopicMetadata
    message_count: int = Field(ge=0)


class Duration(_Model):
    """A length of time."""

    nanoseconds: int = 0


class BagMetadata(_Model):
    """What the analyzer needs of metadata.yaml; further keys are kept and ignored."""

    version: int
    storage_identifier: str
    relative_file_paths: list[str] = Field(min_length=1)
    message_count: int = Field(ge=0)
    topics_with_message_count: list[TopicCount]
    compression_format: str | None = ""
    compression_mode: str | None = ""
    duration: Duration = Duration()
    custom_data: dict[Any, Any] | None = None

    @property
    def topics(self) -> list[TopicMetadata]:
        """The topics, of which some may have no message."""
        return [entry.topic_metadata for entry in self.topics_with_message_count]

    @property
    def counts(self) -> dict[str, int]:
        """Number of messages of each topic that has any."""
        counts: dict[str, int] = {}
        for entry in self.topics_with_message_count:
            name = entry.topic_metadata.name
            counts[name] = counts.get(name, 0) + entry.message_count
        return {name: count for name, count in counts.items() if count}


class _File(_Model):
    rosbag2_bagfile_information: BagMetadata


def read_metadata(bag: Path) -> BagMetadata:
    """Read and validate metadata.yaml of the bag folder.

    Raises:
        InputError: it is missing, unreadable, incomplete, or of a version or compression that is
            not supported.
    """
    path = bag / METADATA
    try:
        metadata = _File.model_validate(_load_yaml(path)).rosbag2_bagfile_information
    except ValidationError as error:
        raise InputError(f"{path}: {first_problem(error).rstrip('.')}; {MEND}.") from None
    if not 4 <= metadata.version <= 9:
        raise InputError(
            f"{path}: version {metadata.version} is not supported; convert the bag to version 9 "
            "with `ros2 bag convert`."
        )
    if metadata.storage_identifier not in ("mcap", "sqlite3"):
        raise InputError(
            f"{path}: storage {metadata.storage_identifier!r} is not supported; convert the bag to "
            "mcap with `ros2 bag convert`."
        )
    mode = (metadata.compression_mode or "none").lower()
    if mode not in ("none", "storage"):
        raise InputError(
            f"{path}: compression by {mode} is not supported; convert the bag to mcap with chunk "
            "compression with `ros2 bag convert`."
        )
    if sum(metadata.counts.values()) != metadata.message_count:
        raise InputError(
            f"{path}: message_count {metadata.message_count} is not the sum over the topics; "
            f"{MEND}."
        )
    return metadata


def _load_yaml(path: Path) -> Any:
    try:
        if not path.parent.is_dir():
            raise InputError(f"{path.parent}: is not a bag; name the folder of metadata.yaml.")
        if not path.is_file():
            raise InputError(f"{path}: is missing, so the bag is not whole; {MEND}.")
        if path.stat().st_size > _MAX_METADATA:
            raise InputError(f"{path}: is larger than {_MAX_METADATA} bytes; {MEND}.")
        text = path.read_bytes().decode()
    except OSError as error:
        raise InputError(f"{path}: cannot be read ({error.strerror}).") from None
    except UnicodeDecodeError:
        raise InputError(f"{path}: is corrupted (not UTF-8); {MEND}.") from None
    try:
        return load_plain_yaml(text)
    except ValueError:
        raise InputError(f"{path}: is corrupted (not YAML); {MEND}.") from None


def storage_files(bag: Path, metadata: BagMetadata) -> list[Path]:
    """Return the bag's storage files; raise InputError if one is missing or outside the bag."""
    files = []
    for name in metadata.relative_file_paths:
        where = f"{bag / METADATA}: relative_file_paths: {name!r}"
        relative = PurePosixPath(name)
        try:
            path = bag / relative
            inside = not relative.is_absolute() and ".." not in relative.parts
            if not inside or not path.resolve().is_relative_to(bag.resolve()):
                raise InputError(f"{where} points outside the bag; keep its files in its folder.")
            if not path.is_file():
                raise InputError(f"{where} does not exist; copy the whole bag or {MEND}.")
        except (OSError, ValueError, RuntimeError):
            raise InputError(f"{where} is not a file name; {MEND}.") from None
        files.append(path)
    if len(set(files)) != len(files):
        raise InputError(f"{bag / METADATA}: relative_file_paths names a file twice; {MEND}.")
    return files
