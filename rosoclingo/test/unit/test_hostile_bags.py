"""Bags that somebody has made to fill the memory, and bags of which anything is damaged."""

from __future__ import annotations

import bz2
import contextlib
import random
import struct
import tracemalloc
from pathlib import Path
from typing import Any, Callable, Dict, Tuple

import lz4.frame
import pytest
from bag_maker import ROOT, data, run, source, texts

from rosoclingo.bags.model import Recording
from rosoclingo.bags.read import decompress
from rosoclingo.bags.read.reader import read_recording
from rosoclingo.bags.topics import LOOP_TYPES
from rosoclingo.errors import BagError

MIB = 2**20
MOST = 8  # MiB that a small bag may expand to here
NUMBERS = [str(number) for number in range(1, 21)]

COMPRESS: Dict[str, Callable[[bytes], bytes]] = {
    "bz2": lambda data: bz2.compress(data, 1),
    "lz4": lz4.frame.compress,
}


@pytest.fixture
def low_limits(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decompress, "_LEAST", MOST * MIB)
    monkeypatch.setattr(decompress, "_RATIO", 1)


def read(file: Path) -> Recording:
    """Reads a bag, which takes little more memory than what it may expand to."""
    tracemalloc.start()
    try:
        return read_recording(file)
    finally:
        _, peak = tracemalloc.get_traced_memory()
        tracemalloc.stop()
        assert peak < (MOST + 12) * MIB


def _record(data: bytes, length: int = -1, /, **fields: bytes) -> bytes:
    """Returns a record; its length may be said to be another one."""
    header = b"".join(
        struct.pack("<I", len(name) + 1 + len(value)) + name.encode() + b"=" + value
        for name, value in fields.items()
    )
    said = len(data) if length < 0 else length
    return struct.pack("<I", len(header)) + header + struct.pack("<I", said) + data


def _chunk(compression: str, content: bytes, size: int) -> bytes:
    return _record(
        content, op=b"\5", compression=compression.encode(), size=struct.pack("<I", size)
    )


def _add(tmp_path: Path, records: bytes) -> Path:
    """Adds records to the end of an intact bag."""
    file = run().write(tmp_path / "a.bag")
    file.write_bytes(file.read_bytes() + records)
    return file


@pytest.mark.usefixtures("low_limits")
@pytest.mark.parametrize("said", [2**32 - 1, 1000])
@pytest.mark.parametrize("compression", COMPRESS)
def test_a_chunk_that_expands_to_too_much(tmp_path: Path, compression: str, said: int) -> None:
    zeros = COMPRESS[compression](bytes((MOST + 16) * MIB))
    file = _add(tmp_path, _chunk(compression, zeros, said))
    message = rf"a\.bag: the chunk at byte \d+ .* to more than {MOST} MiB.*rosbag decompress a\.bag"
    with pytest.raises(BagError, match=message):
        read(file)


def test_a_chunk_that_is_too_long(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(decompress, "_LONGEST_CHUNK", MOST * MIB)
    file = _add(tmp_path, _chunk("lz4", lz4.frame.compress(bytes(24 * MIB)), 1000))
    with pytest.raises(BagError, match=rf"the chunk at byte \d+ expands to more than {MOST} MiB"):
        read(file)


@pytest.mark.usefixtures("low_limits")
def test_chunks_that_together_expand_to_too_much(tmp_path: Path) -> None:
    file = _add(tmp_path, 3 * _chunk("lz4", lz4.frame.compress(bytes(3 * MIB)), 3 * MIB))
    with pytest.raises(BagError, match=f"and those before it expand to more than {MOST} MiB"):
        read(file)


def test_chunks_are_decompressed_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    file = run().write(tmp_path / "a.bag", "bz2")
    made = []

    def decompressor(make: Any = bz2.BZ2Decompressor) -> Any:
        made.append(make())
        return made[-1]

    monkeypatch.setattr(bz2, "BZ2Decompressor", decompressor)  # of bz2.decompress, too
    monkeypatch.setitem(decompress._DECOMPRESSORS, "bz2", decompressor)
    assert texts(read(file)) == NUMBERS
    assert len(made) == file.read_bytes().count(b"compression=bz2")


@pytest.mark.parametrize(
    "record",
    [
        _record(b"short", 2**32 - 1, op=b"\2", conn=bytes(4), time=bytes(8)),
        _record(b"short", 2**32 - 1, op=b"\5", compression=b"none", size=b"\xff" * 4),
        _record(b"short", 2**32 - 1, op=b"\7", conn=bytes(4), topic=b"/a"),
        _record(b"short", 2**32 - 1, op=b"\4", conn=bytes(4), ver=b"\1\0\0\0", count=b"\xff" * 4),
        b"\xff" * 4 + b"short",
        b"\xff" * 2,
    ],
    ids=["message", "chunk", "connection", "index", "header", "length"],
)
def test_lengths_beyond_the_end(tmp_path: Path, record: bytes) -> None:
    file = _add(tmp_path, record)
    content = file.read_bytes()
    at = content.index(b"index_pos=") + len(b"index_pos=")
    file.write_bytes(content[:at] + bytes(8) + content[at + 8 :])
    recording = read(file)
    assert texts(recording) == NUMBERS
    assert recording.remarks[-1].startswith("lost: the bag, byte ")


def test_an_index_that_claims_too_much(tmp_path: Path) -> None:
    file = run().write(tmp_path / "a.bag")
    content = file.read_bytes()
    for name in (b"conn_count=", b"chunk_count="):
        at = content.index(name) + len(name)
        content = content[:at] + b"\xff" * 4 + content[at + 4 :]
    file.write_bytes(content)
    recording = read(file)
    assert texts(recording) == NUMBERS
    assert "the index does not fit the rest" in recording.remarks[0]


def test_nothing_but_a_long_chunk(tmp_path: Path) -> None:
    file = tmp_path / "a.bag"
    zeros = lz4.frame.compress(bytes(8 * MIB))
    file.write_bytes(b"#ROSBAG V2.0\n" + _chunk("lz4", zeros, 8 * MIB))
    with pytest.raises(BagError, match="this is no record of a bag"):
        read(file)


def test_a_definition_that_takes_hours_to_read(tmp_path: Path) -> None:
    maker = run()
    kind = LOOP_TYPES["journal"]
    long = source("/rosoclingo/journal", kind, comment="#\n" * 2**16)
    maker.messages.append((long, 3.0, data(kind, number=21)))
    recording = read(maker.write(tmp_path / "a.bag", "bz2"))
    assert texts(recording) == NUMBERS
    assert "the definition" in recording.remarks[0]
    assert "too long to be true" in recording.remarks[0]


def damage(content: bytes, chance: random.Random) -> bytes:
    """Changes, removes, repeats or inserts some bytes, or cuts off the rest."""
    damaged = bytearray(content)
    for _ in range(chance.choice((1, 1, 1, 2, 5, 20))):
        at = chance.randrange(len(damaged) + 1)
        length = chance.choice((1, 1, 4, chance.randrange(300)))
        kind = chance.randrange(8)
        if kind == 0:
            del damaged[at:]
        elif kind == 1:
            del damaged[at : at + length]
        elif kind == 2:
            damaged[at:at] = damaged[at : at + length]
        elif kind == 3:
            damaged[at : at + 4] = chance.choice((b"\xff" * 4, bytes(4), b"\xff\xff\xff\x7f"))
        elif kind == 4:
            other = chance.randrange(len(damaged) + 1)
            damaged[at : at + length] = damaged[other : other + length]
        else:
            damaged[at : at + length] = bytes(chance.randrange(256) for _ in range(length))
    return bytes(damaged)


def read_anyway(file: Path, content: bytes) -> None:
    """Reads a bag; nothing but a :class:`BagError` may come out."""
    file.write_bytes(content)
    with contextlib.suppress(BagError):
        assert isinstance(read_recording(file), Recording)


@pytest.fixture(scope="module", params=["line_single_paper.bag", "blocks_world_static_fixed.bag"])
def sample(request: pytest.FixtureRequest) -> Tuple[bytes, bytes]:
    """A bag as it was recorded and compressed, and the same without compression."""
    content = (ROOT / "test" / "bags" / request.param).read_bytes()
    return content, decompressed(content)


def decompressed(content: bytes) -> bytes:
    """Returns a bag whose chunks are not compressed, so that damage reaches what is in them."""
    found, position = content[:13], 13
    while position < len(content):
        begin = position + 4 + struct.unpack_from("<I", content, position)[0]
        end = begin + 4 + struct.unpack_from("<I", content, begin)[0]
        if b"op=\5" in content[position:begin]:
            data = bz2.decompress(content[begin + 4 : end])
            size = struct.pack("<I", len(data))
            found += _record(data, op=b"\5", compression=b"none", size=size)
        else:
            found += content[position:end]
        position = end
    return found


@pytest.mark.parametrize("seed", range(40))
def test_any_damage(tmp_path: Path, sample: Tuple[bytes, bytes], seed: int) -> None:
    chance = random.Random(seed)
    read_anyway(tmp_path / "a.bag", damage(sample[seed % 2], chance))


def test_the_samples_are_intact(tmp_path: Path, sample: Tuple[bytes, bytes]) -> None:
    file = tmp_path / "a.bag"
    found = []
    for content in sample:
        file.write_bytes(content)
        found.append(read_recording(file).entries)
    assert found[0]
    assert found[0] == found[1]
