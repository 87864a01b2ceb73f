"""write_bag.py FOLDER DEFINITION: bags of ROS 1 of every compression by Debian's python3-rosbag in FOLDER, of messages of the
type oracle_msgs/Everything that DEFINITION lays out, serialized by genpy; NAME.bag and beside it NAME.lines, what dump_log.cpp
should print of it."""
import pathlib
import random
import shutil
import struct
import sys

import genpy
import genpy.dynamic
import rosbag

from lines import line_of

folder = pathlib.Path(sys.argv[1])
classes = genpy.dynamic.generate_dynamic("oracle_msgs/Everything", pathlib.Path(sys.argv[2]).read_text())
randoms = random.Random(1)
BITS = {"int8": 8, "uint8": 8, "int16": 16, "uint16": 16, "int32": 32, "uint32": 32, "int64": 64, "uint64": 64, "byte": 8, "char": 8}
TEXTS = ["left_wheel", "", "Rädchen µ ☃ 🤖", "a=b c\n", "\0inside\0it", "x" * 300]
FLOATS = [float("nan"), -0.0, float("inf"), -float("inf"), 5e-324, 1.7976931348623157e308, 0.1, 2.0**53 + 2]


def one(kind, how):
    """A value of a type, and what a line shows of it."""
    if kind in BITS:
        is_signed = kind.startswith("int") or kind == "byte"
        low, high = (-(1 << BITS[kind] - 1), (1 << BITS[kind] - 1) - 1) if is_signed else (0, (1 << BITS[kind]) - 1)
        value = {"least": low, "greatest": high}.get(how, randoms.randint(low, high))
        return value, value
    if kind == "bool":
        value = how == "greatest" or how != "least" and randoms.random() < 0.5
        return value, value
    if kind in ("float32", "float64"):
        value = randoms.choice(FLOATS) if how == "odd" else randoms.uniform(-1e6, 1e6)
        if kind == "float32":
            value = struct.unpack("f", struct.pack("f", value if abs(value) < 3e38 or abs(value) == float("inf") else 0.0))[0]
        return value, value
    if kind == "string":
        value = "" if how == "least" else randoms.choice(TEXTS)
        return value, value.encode()
    if kind == "time":
        seconds = {"least": 0, "greatest": 2**32 - 1}.get(how, randoms.randrange(2**31))
        nanoseconds = {"least": 0, "greatest": 999_999_999}.get(how, randoms.randrange(10**9))
        return genpy.Time(seconds, nanoseconds), seconds * 10**9 + nanoseconds
    seconds, nanoseconds = {"least": (-(2**31), 0)}.get(how, (randoms.randrange(-(2**31), 2**31), randoms.randrange(10**9)))
    return genpy.Duration(seconds, nanoseconds), seconds * 10**9 + nanoseconds


def message(kind, how, before, fields):
    made = classes[kind]() if kind in classes else None
    for name, of in zip(made.__slots__, made._slot_types):
        base, _, count = of.partition("[")
        path = before + name

        def element(place):
            if base in classes:
                return message(base, how, place + ".", fields)
            # @foxglove/rosmsg-serialization takes the seconds of arrays of times for signed.
            value, shown = one(base, "any" if count and base == "time" and how == "greatest" else how)
            fields.append((place, shown))
            return value

        if not count:
            setattr(made, name, element(path))
            continue
        number = int(count[:-1] or {"least": 0, "greatest": 5}.get(how, randoms.randrange(5)))
        values = [element(f"{path}[{i}]") for i in range(number)]
        if base in ("uint8", "char"):
            values = bytes(values)  # as genpy has them
        setattr(made, name, values)
    return made


def write(name, topics=("/one", "/other"), is_closed=True, **options):
    bag = rosbag.Bag(folder / f"{name}.bag", "w", **options)
    lines = []
    for i in range(8):
        for topic in topics:
            fields = []
            made = message("oracle_msgs/Everything", ["least", "greatest", "odd", "odd"][i] if i < 4 else "any", "", fields)
            seconds, nanoseconds = 1_700_000_000 + i, randoms.randrange(10**9)
            bag.write(topic, made, genpy.Time(seconds, nanoseconds))
            lines.append(line_of(topic, seconds * 10**9 + nanoseconds, fields))
    if is_closed:
        bag.close()
    else:  # as the recorder's .bag.active: chunks without an index
        bag.flush()
        shutil.copyfile(folder / f"{name}.bag", folder / "copy")
        bag.close()
        (folder / "copy").rename(folder / f"{name}.bag")
    (folder / f"{name}.lines").write_text("\n".join(lines) + "\n")


for compression in "none", "bz2", "lz4":
    write(compression, compression=compression)
    write(f"{compression}_small_chunks", compression=compression, chunk_threshold=4000)
    write(f"{compression}_not_closed", compression=compression, chunk_threshold=4000, is_closed=False)
