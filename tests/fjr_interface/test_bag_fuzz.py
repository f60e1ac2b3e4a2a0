"""Damages bags in every way: what is read is identical, or it is refused, and memory is bounded."""

from __future__ import annotations

import os
import shutil
import struct
import tracemalloc
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

import pytest
from bag_tools import boundaries, experiment, rewrite, write_bag
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from mcap.opcode import Opcode
from mcap.stream_reader import StreamReader
from mcap.writer import CompressionType

from fjr_interface.bags.blocks import MAX_RECORD
from fjr_interface.bags.mcap_blocks import McapFile
from fjr_interface.bags.reader import BagReader
from fjr_kit.errors import InputError

MANY = settings(
    max_examples=150,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture, HealthCheck.too_slow],
)
Content = dict[str, list[bytes]]


def content(path: Path) -> Content:
    """Return all payloads of one mcap file by topic."""
    payloads: Content = {}
    for block in McapFile(path).blocks():
        found = [block.payload(i) for i in range(len(block.starts))]
        payloads.setdefault(block.topic.name, []).extend(found)
    return payloads


def everything(bag: Path) -> tuple:
    """Return all that a reader gives of a bag, as bytes."""
    reader = BagReader(bag)
    (record,) = reader.blocks(10**9)
    arrays = (record.stamps_ns, record.reference, record.torque, record.position)
    return reader.experiment, reader.sample_rate_hz, [array.tobytes() for array in arrays]


def outcome(read: Callable, path: Path):
    """Return what was read, or None if it was refused with one sentence."""
    try:
        return read(path)
    except InputError as error:
        sentence = str(error)
        assert sentence.startswith(str(path)) and sentence.endswith(".") and "\n" not in sentence
        return None


@pytest.fixture(scope="module")
def bag(tmp_path_factory) -> Path:
    folder = tmp_path_factory.mktemp("whole") / "bag"
    write_bag(folder, experiment(samples_per_period=12))
    return folder


@pytest.fixture(scope="module")
def victim(bag, tmp_path_factory) -> Path:
    return shutil.copytree(bag, tmp_path_factory.mktemp("victim") / "bag")


@contextmanager
def changed(path: Path, at: int, new: bytes) -> Iterator[None]:
    """Overwrite bytes of a file in place, and put the old ones back."""
    with path.open("r+b", buffering=0) as file:
        old = os.pread(file.fileno(), len(new), at)
        os.pwrite(file.fileno(), new, at)
        yield
        os.pwrite(file.fileno(), old, at)


def test_every_cut_of_the_file_is_refused(bag, tmp_path):
    path = shutil.copy(bag / "bag.mcap", tmp_path / "bag.mcap")
    for cut in reversed(range(path.stat().st_size)):
        os.truncate(path, cut)
        assert outcome(content, path) is None, cut


def test_every_flipped_byte_of_the_file_is_refused_or_harmless(bag, tmp_path):
    path = shutil.copy(bag / "bag.mcap", tmp_path / "bag.mcap")
    data, whole = path.read_bytes(), content(path)
    harmless = []
    for at in range(len(data)):
        with changed(path, at, bytes([data[at] ^ 1 << at % 8])):
            found = outcome(content, path)
        assert found in (None, whole), at
        if found is not None:
            harmless.append(at)
    assert harmless == []  # the checksums cover the whole file


@MANY
@given(st.data())
def test_cut_bags_are_refused(bag, victim, data):
    whole = (bag / "bag.mcap").read_bytes()
    near = [b + step for b in boundaries(bag / "bag.mcap") for step in (-1, 0, 1)]
    inside = [cut for cut in near if 0 <= cut < len(whole)]
    cut = data.draw(st.one_of(st.sampled_from(inside), st.integers(0, len(whole) - 1)))
    (victim / "bag.mcap").write_bytes(whole[:cut])
    assert outcome(everything, victim) is None


@MANY
@given(st.lists(st.tuples(st.integers(0, 2**31), st.integers(1, 255)), min_size=1, max_size=4))
def test_flipped_bytes_never_change_what_is_read(bag, victim, flips):
    damaged = bytearray((bag / "bag.mcap").read_bytes())
    for at, mask in flips:
        damaged[at % len(damaged)] ^= mask
    (victim / "bag.mcap").write_bytes(damaged)
    assert outcome(everything, victim) in (None, everything(bag))


@MANY
@given(st.integers(0, 2**31), st.integers(1, 255), st.booleans())
def test_damaged_metadata_never_changes_what_is_read(bag, victim, at, mask, cut):
    shutil.copy(bag / "bag.mcap", victim / "bag.mcap")
    text = bytearray((bag / "metadata.yaml").read_bytes())
    at %= len(text)
    text[at] ^= mask
    (victim / "metadata.yaml").write_bytes(text[:at] if cut else text)
    try:
        assert outcome(everything, victim) in (None, everything(bag))
    finally:
        shutil.copy(bag / "metadata.yaml", victim / "metadata.yaml")


@MANY
@given(st.binary(max_size=300), st.integers(0, 2**31), st.integers(0, 300))
def test_spliced_bytes_never_change_what_is_read(bag, victim, junk, at, removed):
    whole = (bag / "bag.mcap").read_bytes()
    at %= len(whole)
    damaged = whole[:at] + junk + whole[at + removed :]
    (victim / "bag.mcap").write_bytes(damaged)
    assert outcome(everything, victim) in (None, everything(bag))


@pytest.mark.parametrize(
    "options",
    [
        {"compression": CompressionType.ZSTD, "enable_crcs": False},
        {"compression": CompressionType.LZ4, "enable_crcs": False},
        {"compression": CompressionType.NONE, "enable_crcs": False},
        {"use_chunking": False, "enable_crcs": False},
    ],
    ids=["zstd", "lz4", "none", "unchunked"],
)
def test_foreign_files_without_checksums_raise_nothing_else(bag, tmp_path, options):
    folder = shutil.copytree(bag, tmp_path / "bag")
    rewrite(folder, **options)
    path = folder / "bag.mcap"
    whole, data = content(path), path.read_bytes()
    messages = sum(map(len, whole.values()))
    for at in range(0, len(data), 5):
        with changed(path, at, bytes([data[at] ^ 0xFF])):
            found = outcome(content, path)
        # Without checksums the bytes of a message may change, never the number of messages.
        assert found is None or sum(map(len, found.values())) == messages
    for cut in reversed(range(0, len(data), 7)):
        os.truncate(path, cut)
        assert outcome(content, path) is None


def test_a_lying_message_index_changes_nothing(bag, tmp_path):
    folder = shutil.copytree(bag, tmp_path / "bag")
    rewrite(folder, enable_crcs=False, chunk_size=3000)
    path = folder / "bag.mcap"
    whole, data = content(path), path.read_bytes()
    indexes = [at for at in boundaries(path)[1:-2] if data[at] == Opcode.MESSAGE_INDEX]
    assert len(indexes) > 3
    for start in indexes:
        length = int.from_bytes(data[start + 1 : start + 9], "little")
        for at in range(start + 9, start + 9 + length, 3):
            with changed(path, at, bytes([data[at] ^ 0x11])):
                assert outcome(content, path) == whole


def patched(bag: Path, tmp_path: Path, changes: dict[int, bytes]) -> Path:
    """Copy the bag's file and overwrite bytes at offsets within its first chunk record."""
    data = bytearray((bag / "bag.mcap").read_bytes())
    start = next(at for at in boundaries(bag / "bag.mcap")[1:] if data[at] == Opcode.CHUNK)
    for offset, new in changes.items():
        data[start + offset : start + offset + len(new)] = new
    path = tmp_path / "bag.mcap"
    path.write_bytes(data)
    return path


def peak_memory(path: Path) -> int:
    tracemalloc.start()
    try:
        assert outcome(content, path) is None
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()


LENGTH, CLAIM, FRAME = 1, 9 + 16, 9 + 44  # in a chunk record: its length, its claimed size, data


@pytest.mark.parametrize("size", [MAX_RECORD - 1, MAX_RECORD + 1, 2**40, 2**63, 2**64 - 1])
@pytest.mark.parametrize("where", [LENGTH, CLAIM])
def test_absurd_sizes_are_refused_before_memory_is_taken(bag, tmp_path, size, where):
    path = patched(bag, tmp_path, {where: struct.pack("<Q", size)})
    assert peak_memory(path) < 1_000_000


@pytest.mark.parametrize("size", [MAX_RECORD + 1, 2**40, 2**63])
def test_a_zstd_frame_that_claims_an_absurd_size_is_refused(bag, tmp_path, size):
    with (bag / "bag.mcap").open("rb") as file:
        records = StreamReader(file, emit_chunks=True).records
        chunk = next(record for record in records if type(record).__name__ == "Chunk")
    magic, descriptor = chunk.data[:4], 0xE0  # single segment, eight bytes of content size
    frame = magic + bytes([descriptor]) + struct.pack("<Q", size)
    honest = {FRAME: frame}
    agreeing = {FRAME: frame, CLAIM: struct.pack("<Q", size)}
    for changes in (honest, agreeing):
        assert peak_memory(patched(bag, tmp_path, changes)) < 1_000_000


def test_strings_that_claim_more_than_there_is(bag, tmp_path):
    folder = shutil.copytree(bag, tmp_path / "bag")
    rewrite(folder, use_chunking=False, enable_crcs=False)
    path = folder / "bag.mcap"
    whole = path.read_bytes()
    for start in (at for at in boundaries(path)[1:-2] if whole[at] != Opcode.MESSAGE):
        body = start + 9
        for at in range(body, min(body + 24, len(whole) - 4)):
            with changed(path, at, b"\xff\xff\xff\x7f"):
                tracemalloc.start()
                outcome(content, path)
                peak = tracemalloc.get_traced_memory()[1]
                tracemalloc.stop()
            assert peak < 1_000_000
