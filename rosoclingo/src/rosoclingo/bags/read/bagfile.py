"""Reads a bag, also a damaged one. Needs no ROS."""

from __future__ import annotations

import re
from pathlib import Path

from rosoclingo.bags.read.decompress import ExpansionError
from rosoclingo.bags.read.records import Records
from rosoclingo.errors import BagError

_MAGIC = re.compile(rb"#ROSBAG V(\d{1,9})\.(\d{1,9})\r?\n")
_LONGEST_MAGIC = 32  # bytes


def read_bag(file: Path) -> Records:
    """Reads a bag; one that is damaged, as far as that goes.

    Raises:
        BagError: It is no bag, or nothing can be read.
    """
    if file.is_dir():
        raise BagError(f"{file}: this is a folder; give the path of a bag in it")
    try:
        with file.open("rb") as opened:
            opened.seek(_check(file, opened.read(_LONGEST_MAGIC)))
            records = Records(opened)
    except OSError as err:
        raise BagError(f"{file}: {err.strerror}; give the path of a bag") from err
    except ExpansionError as err:
        raise BagError(
            f"{file}: {err}, which is no recording's; if you trust the bag, decompress it in a ROS "
            f"installation: rosbag decompress {file.name}"
        ) from err
    _judge(file, records)
    return records


def _judge(file: Path, records: Records) -> None:
    """Raises an error if nothing could be read."""
    if records.encryptor:
        raise BagError(
            f"{file}: the bag is encrypted; decrypt it in a ROS installation: "
            f"rosbag decrypt {file.name}"
        )
    if not records.connections and (records.losses or records.fault):
        lost = [*records.losses, records.fault][0]
        raise BagError(f"{file}: nothing can be read of the bag: {lost}; record again")


def _check(file: Path, begin: bytes) -> int:
    """Returns where the first record is."""
    if not begin:
        raise BagError(f"{file}: the file is empty; its recorder wrote nothing: record again")
    magic = _MAGIC.match(begin)
    if magic is None:
        raise BagError(f"{file}: this is no ROS 1 bag (it does not begin with #ROSBAG)")
    version = int(magic[1]), int(magic[2])
    if version != (2, 0):
        raise BagError(
            f"{file}: a bag of version {version[0]}.{version[1]}, and only 2.0 is read; convert it "
            f"in a ROS installation: rosbag filter {file.name} new.bag True"
        )
    return magic.end()
