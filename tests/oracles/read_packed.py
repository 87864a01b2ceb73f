"""read_packed.py FILE: what dump_log.cpp prints of a .wpilog or a .bin, with nothing but Python's struct.

Written from the published formats alone, for want of a library that could be installed: allwpilib's wpiutil/doc/datalog.adoc
and struct.adoc, ArduPilot's libraries/AP_Logger/LogStructure.h.
"""
import re
import struct
import sys

from lines import line_of, line_of_bytes


# ---- WPILOG ----

SIZES = {"bool": 1, "char": 1, "int8": 1, "int16": 2, "int32": 4, "int64": 8, "uint8": 1, "uint16": 2, "uint32": 4, "uint64": 8}
CODES = {"bool": "?", "int8": "b", "int16": "h", "int32": "i", "int64": "q", "uint8": "B", "uint16": "H", "uint32": "I",
         "uint64": "Q", "float": "f", "float32": "f", "double": "d", "float64": "d"}
DECLARATION = re.compile(r"(?:(?:enum)?\s*\{[^}]*\}\s*)?(\S+)\s+([^\s:\[]+)\s*(?:\[\s*(\d+)\s*\]|:\s*(\d+))?")


class Structures:
    """Of the schemas that a log holds."""

    def __init__(self):
        self.schemas = {}

    def take(self, name, data, at, before, out):
        """Appends the fields of a structure at a place, and returns the place behind it."""
        width = used = held = 0  # of the integer in which bit-fields lie

        for declaration in filter(None, (part.strip() for part in self.schemas[name].split(";"))):
            kind, field, count, bits = DECLARATION.fullmatch(declaration).groups()
            path = before + field
            if bits is not None:
                bits, size = int(bits), SIZES[kind]
                # A flag goes into whatever is open; other bit-fields into an integer of their own width.
                joins = width and used + bits <= 8 * width and (kind == "bool" or size == width)
                if not joins:
                    width, used = size, 0
                    held = int.from_bytes(data[at : at + width], "little")
                    at += width
                value = held >> used & (1 << bits) - 1
                used += bits
                if kind.startswith("int") and value >> bits - 1:
                    value -= 1 << bits
                out.append((path, value))
                continue
            width = 0
            if kind == "char":
                size = int(count or 1)
                out.append((path, data[at : at + size].split(b"\0")[0]))
                at += size
                continue
            for i in range(int(count or 1)):
                place = path if count is None else f"{path}[{i}]"
                if kind in CODES:
                    (value,) = struct.unpack_from("<" + CODES[kind], data, at)
                    out.append((place, value))
                    at += struct.calcsize(CODES[kind])
                else:
                    at = self.take(kind, data, at, place + ".", out)
        return at

    def fields(self, kind, payload):
        """None: a schema is not known, or the payload is too short."""
        name, out, at, index = kind[len("struct:") :].removesuffix("[]"), [], 0, 0
        try:
            if not kind.endswith("[]"):
                self.take(name, payload, 0, "", out)
                return out
            while at < len(payload):
                at = self.take(name, payload, at, f"value[{index}].", out)
                index += 1
        except (KeyError, struct.error):
            return None
        return out


def wpilog_fields(structures, kind, payload):
    if kind in ("string", "json", "structschema"):
        return [("value", payload)]
    if kind.startswith("struct:"):
        return structures.fields(kind, payload)
    if kind == "string[]":
        fields, at = [], 4
        for i in range(struct.unpack_from("<I", payload)[0]):
            (size,) = struct.unpack_from("<I", payload, at)
            fields.append((f"value[{i}]", payload[at + 4 : at + 4 + size]))
            at += 4 + size
        return fields
    codes = {"boolean": "?", "int64": "q", "float": "f", "double": "d"}
    if kind in codes:
        return [("value", struct.unpack("<" + codes[kind], payload)[0])]
    if kind.removesuffix("[]") not in codes:
        return None
    code = struct.Struct("<" + codes[kind.removesuffix("[]")])
    return [(f"value[{i}]", value) for i, (value,) in enumerate(code.iter_unpack(payload))]


def wpilog(data):
    at, entries, structures = 12 + struct.unpack_from("<I", data, 8)[0], {}, Structures()

    def take(size):
        nonlocal at
        at += size
        return data[at - size : at]

    def texts(payload, count):
        start, found = 5, []
        for _ in range(count):
            (length,) = struct.unpack_from("<I", payload, start)
            found.append(payload[start + 4 : start + 4 + length].decode())
            start += 4 + length
        return found

    while at < len(data):
        lengths = take(1)[0]
        entry, size, time_us = (
            int.from_bytes(take(n), "little")
            for n in ((lengths & 3) + 1, (lengths >> 2 & 3) + 1, (lengths >> 4 & 7) + 1)
        )
        payload = take(size)
        if entry == 0:
            (subject,) = struct.unpack_from("<I", payload, 1)
            if payload[0] == 0:
                entries[subject] = texts(payload, 2)
            elif payload[0] == 1:
                entries.pop(subject, None)
            continue
        if entry not in entries:
            continue
        name, kind = entries[entry]
        if kind == "structschema":
            structures.schemas[name.split(".schema/struct:")[1]] = payload.decode()
        fields = wpilog_fields(structures, kind, payload)
        if fields is None:
            print(line_of_bytes(name, time_us * 1000, payload))
        else:
            print(line_of(name, time_us * 1000, fields))


# ---- DataFlash ----

FIELDS = dict(b="b", B="B", h="h", H="H", i="i", I="I", f="f", d="d", q="q", Q="Q", M="B", n="4s", N="16s", Z="64s", g="e")
SCALED = dict(c=("h", 0.01), C=("H", 0.01), e=("i", 0.01), E=("I", 0.01), L=("i", 1e-7))


def dataflash(data):
    formats, at, time_ns = {128: ("FMT", 89, "BBnNZ", ["Type", "Length", "Name", "Format", "Columns"])}, 0, 0
    instances = {}  # of a type: the number of the field that says which
    while at + 3 <= len(data):
        name, length, kinds, labels = formats[data[at + 2]]
        if at + length > len(data):
            break
        body, offset, fields = data[at + 3 : at + length], 0, []
        for i, kind in enumerate(kinds):
            label = labels[i] if i < len(labels) else f"field{i}"
            if kind == "a":
                fields += [(f"{label}[{n}]", value) for n, value in enumerate(struct.unpack_from("<32h", body, offset))]
                offset += 64
                continue
            code, scale = SCALED.get(kind, (FIELDS.get(kind), 1.0))
            (value,) = struct.unpack_from("<" + code, body, offset)
            offset += struct.calcsize("<" + code)
            if isinstance(value, bytes):
                value = value.split(b"\0")[0]
            fields.append((label, value if scale == 1.0 else value * scale))
        values = dict(fields)
        if name == "GPS" and "T" in values:
            time_ns = values["T"] * 1_000_000
        elif labels and labels[0] in ("TimeMS", "TimeUS"):
            time_ns = values[labels[0]] * (1_000_000 if labels[0] == "TimeMS" else 1000)
        if name == "FMT" and body[0] != 128:
            text = lambda part: part.split(b"\0")[0].decode()
            columns = text(body[22:86])
            formats[body[0]] = (text(body[2:6]), body[1], text(body[6:22]), columns.split(",") if columns else [])
        if name == "FMTU" and b"#" in values["UnitIds"]:
            instances[values["FmtType"]] = values["UnitIds"].index(b"#")
        topic = name
        if (field := instances.get(data[at + 2])) is not None:
            topic += f"[{values[labels[field]]}]"
        print(line_of(topic, time_ns, fields))
        at += length


log = open(sys.argv[1], "rb").read()
wpilog(log) if log.startswith(b"WPILOG") else dataflash(log)
