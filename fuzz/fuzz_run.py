"""Gives doors of the product hostile inputs; a table at the end has what was found.

Each door gets its inputs in processes, one after the other, so that one that ends or hangs is a
fault of the input that it had, which is known by a file that both share.
"""

from __future__ import annotations

import argparse
import contextlib
import json
import logging
import mmap
import os
import struct
import subprocess
import sys
import tempfile
import time
from concurrent.futures import ThreadPoolExecutor
from dataclasses import asdict
from functools import partial
from pathlib import Path
from typing import Any, Dict, List, Optional, Tuple

from all_doors import DOORS, find_door
from fuzzing import Fault, FuzzReport, faults_of, fuzz, limits

_CHUNK = 20_000  # inputs of a process
_LENGTH = struct.Struct("<QI")  # how many inputs have begun, and the length of the last one
_SHARED = 2**20
_STUCK_SECONDS = 120.0  # without a new input
_TICK_SECONDS = 5.0


def main() -> None:
    """Runs the command and ends the process; its exit status says if there are faults."""
    chosen = _parser().parse_args()
    names = chosen.door or list(DOORS)
    for name in names:
        if name not in DOORS:
            sys.exit(f"fuzz: there is no door {name!r}; there are {', '.join(DOORS)}")
    if chosen.chunk:
        _chunk(names[0], chosen.inputs, chosen.seed, Path(chosen.chunk))
        return
    all_is_well = True
    for name in names:
        number = chosen.inputs or find_door(name).inputs
        all_is_well &= _fuzz_door(name, number, chosen.seed, chosen.processes)
    sys.exit(0 if all_is_well else 1)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="scripts/fuzz", description=__doc__.splitlines()[0])
    add = parser.add_argument
    add("door", nargs="*", metavar="DOOR", help="such as bags; by default all, one after the other")
    add("--inputs", type=int, default=0, metavar="N", help="of each door; by default as many as CI")
    add("--seed", type=int, default=1, metavar="S", help="the same one gives the same inputs")
    add("--processes", type=int, default=1, metavar="N", help="that run at a time")
    add("--chunk", help=argparse.SUPPRESS)
    return parser


def _fuzz_door(name: str, number: int, seed: int, processes: int) -> bool:
    """Gives a door inputs, prints what comes of it, and returns whether there is no fault."""
    began = time.monotonic()
    sizes = [min(_CHUNK, number - done) for done in range(0, number, _CHUNK)]
    seeds = [seed * 1_000_003 + place for place in range(len(sizes))]
    reports: List[FuzzReport] = []
    with ThreadPoolExecutor(processes) as pool:
        for report in pool.map(partial(_process, name), sizes, seeds):
            reports.append(report)
            if time.monotonic() - began > _TICK_SECONDS and len(sizes) > 1:
                done = sum(one.inputs for one in reports)
                print(f"{name}: {done} of {number}", file=sys.stderr, flush=True)
    faults = faults_of(reports)
    taken, refused = (sum(getattr(one, key) for one in reports) for key in ("taken", "refused"))
    seconds, slowest = sum(one.seconds for one in reports), max(one.slowest for one in reports)
    print(
        f"{name}: {taken + refused} inputs, {taken} taken, {refused} refused, "
        f"{len(faults)} faults; {seconds:.0f} s of processor time, the slowest {slowest:.2f} s",
        flush=True,
    )
    for fault in faults:
        print(f"{fault}\n", flush=True)
    return not faults


def _process(name: str, number: int, seed: int) -> FuzzReport:
    """Runs a process, and returns its report."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "shared"
        file.write_bytes(bytes(_SHARED))
        command = [sys.executable, __file__, name, "--inputs", str(number), "--seed", str(seed)]
        with subprocess.Popen(
            [*command, "--chunk", str(file)], stdout=subprocess.PIPE, stderr=subprocess.DEVNULL
        ) as child:
            output, last = _wait(child, file)
        if child.returncode == 0 and output:
            values: Dict[str, Any] = json.loads(output)
            faults = {
                key: Fault(bytes.fromhex(fault["data"]), fault["reason"])
                for key, fault in values.pop("faults").items()
            }
            return FuzzReport(**values, faults=faults)
    count, data = last
    reason = f"the process has ended with status {child.returncode}, at input {count}"
    return FuzzReport(refused=count, faults={reason: Fault(data, reason)})


def _wait(child: subprocess.Popen[bytes], file: Path) -> Tuple[bytes, Tuple[int, bytes]]:
    """Waits for a process, ends one that is stuck, and returns its output and its last input."""
    last, since = (-1, b""), time.monotonic()
    output: Optional[bytes] = None
    while output is None:
        with contextlib.suppress(subprocess.TimeoutExpired):
            output, _ = child.communicate(timeout=1.0)
        now = _last(file.read_bytes())
        if now[0] != last[0]:
            last, since = now, time.monotonic()
        elif time.monotonic() - since > _STUCK_SECONDS:
            child.kill()
    return output, last


def _last(file_bytes: bytes) -> Tuple[int, bytes]:
    count, length = _LENGTH.unpack_from(file_bytes)
    return count, file_bytes[_LENGTH.size : _LENGTH.size + length]


def _chunk(name: str, number: int, seed: int, file: Path) -> None:
    """Gives a door some inputs in this process, and prints the report."""
    logging.disable()
    with file.open("r+b") as opened, mmap.mmap(opened.fileno(), _SHARED) as shared:
        count = 0

        def seen(data: bytes) -> None:
            nonlocal count
            count += 1
            data = data[: _SHARED - _LENGTH.size]
            _LENGTH.pack_into(shared, 0, count, len(data))
            shared[_LENGTH.size : _LENGTH.size + len(data)] = data

        with limits(), find_door(name) as door:
            report = fuzz(door, number, seed, seen)
    values = asdict(report)
    for fault in values["faults"].values():
        fault["data"] = fault["data"].hex()
    print(json.dumps(values), flush=True)
    os._exit(0)  # threads of doors may wait for what does not come


if __name__ == "__main__":
    main()
