"""What dump_log.cpp prints of a .wpilog (structures of plain numbers among them) or a .bin, with nothing but Python's struct.

Usage: dump_packed.py FILE
"""
import math
import struct
import sys

path = sys.argv[1]
data = open(path, "rb").read()


def text_of(value):
    if isinstance(value, bytes):
        return "s" + value.hex()
    if isinstance(value, int):
        return str(value)
    return "nan" if math.isnan(value) else "d" + struct.pack(">d", value).hex()


def show(topic, time_ns, fields, payload):
    if fields is None:
        print(f"{topic} {time_ns} bytes={payload.hex()}")
    else:
        print(topic, time_ns, *(f"{name}={text_of(value)}" for name, value in fields))


def array(code, payload):
    size = struct.calcsize(code)
    count = len(payload) // size
    return [(f"value[{i}]", v) for i, v in enumerate(struct.unpack(f"<{count}{code}", payload[: count * size]))]


schemas = {}


def plain(name):
    """Its numbers, by their paths."""
    for declaration in schemas[name].split(";"):
        kind, field = declaration.split()
        if kind in schemas:
            yield from ((f"{field}.{path}", code) for path, code in plain(kind))
        else:
            yield field, {"double": "d", "float": "f", "int32": "i", "int64": "q"}[kind]


def structure(kind, payload):
    name = kind[len("struct:") :].removesuffix("[]")
    try:
        fields = list(plain(name))
    except (KeyError, ValueError):
        return None
    code = struct.Struct("<" + "".join(code for _, code in fields))
    if not kind.endswith("[]"):
        return [(path, value) for (path, _), value in zip(fields, code.unpack(payload))]
    return [
        (f"value[{i}].{path}", value)
        for i, element in enumerate(code.iter_unpack(payload))
        for (path, _), value in zip(fields, element)
    ]


def wpilog_fields(kind, payload):
    if kind in ("string", "json", "structschema"):
        return [("value", payload)]
    if kind.startswith("struct:"):
        return structure(kind, payload)
    if kind == "string[]":
        fields, at = [], 4
        for i in range(struct.unpack_from("<I", payload)[0]):
            (size,) = struct.unpack_from("<I", payload, at)
            fields.append((f"value[{i}]", payload[at + 4 : at + 4 + size]))
            at += 4 + size
        return fields
    codes = {"boolean": "B", "int64": "q", "float": "f", "double": "d"}
    if kind in codes:
        return [("value", struct.unpack("<" + codes[kind], payload)[0])]
    return array(codes[kind[:-2]], payload) if kind[:-2] in codes else None


def wpilog():
    at, entries = 12 + struct.unpack_from("<I", data, 8)[0], {}

    def take(size):
        nonlocal at
        at += size
        return data[at - size : at]

    while at < len(data):
        lengths = take(1)[0]
        entry, size, time_us = (
            int.from_bytes(take(n), "little")
            for n in ((lengths & 3) + 1, (lengths >> 2 & 3) + 1, (lengths >> 4 & 7) + 1)
        )
        payload = take(size)
        if entry:
            if entries[entry][1] == "structschema":
                schemas[entries[entry][0].split("struct:")[1]] = payload.decode()
            show(entries[entry][0], time_us * 1000, wpilog_fields(entries[entry][1], payload), payload)
        elif payload[0] == 0:
            texts, start = [], 5
            for _ in range(2):
                (length,) = struct.unpack_from("<I", payload, start)
                texts.append(payload[start + 4 : start + 4 + length].decode())
                start += 4 + length
            entries[struct.unpack_from("<I", payload, 1)[0]] = texts


CODES = dict(b="b", B="B", h="h", H="H", i="i", I="I", f="f", d="d", q="q", Q="Q", M="B", n="4s", N="16s", Z="64s")
SCALED = dict(c=("h", 0.01), C=("H", 0.01), e=("i", 0.01), E=("I", 0.01), L=("i", 1e-7))


def dataflash():
    formats, at, time_ns = {128: ("FMT", 89, "BBnNZ", ["Type", "Length", "Name", "Format", "Columns"])}, 0, 0
    while at + 3 <= len(data):
        name, length, kinds, labels = formats[data[at + 2]]
        if at + length > len(data):
            break
        body, offset, fields = data[at + 3 : at + length], 0, []
        for i, kind in enumerate(kinds):
            code, scale = SCALED.get(kind, (CODES.get(kind), 1.0))
            (value,) = struct.unpack_from("<" + code, body, offset)
            offset += struct.calcsize("<" + code)
            if isinstance(value, bytes):
                value = value.split(b"\0")[0]
            fields.append((labels[i] if i < len(labels) else f"field{i}", value if scale == 1.0 else value * scale))
        values = dict(fields)
        if name == "GPS" and "T" in values:
            time_ns = values["T"] * 1_000_000
        elif labels and labels[0] in ("TimeMS", "TimeUS"):
            time_ns = values[labels[0]] * (1_000_000 if labels[0] == "TimeMS" else 1000)
        if name == "FMT" and body[0] != 128:
            text = lambda part: part.split(b"\0")[0].decode()
            columns = text(body[22:86])
            formats[body[0]] = (text(body[2:6]), body[1], text(body[6:22]), columns.split(",") if columns else [])
        show(name, time_ns, fields, body)
        at += length


wpilog() if data.startswith(b"WPILOG") else dataflash()
