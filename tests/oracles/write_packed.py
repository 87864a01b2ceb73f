"""write_packed.py FOLDER: a WPILOG, a DataFlash log and a ULog with every option of their formats in FOLDER, from the published
descriptions alone, for no library that could be installed writes them: NAME and beside it NAME.lines, what dump_log.cpp should
print of it.

https://github.com/wpilibsuite/allwpilib/blob/main/wpiutil/doc/datalog.adoc and struct.adoc, ArduPilot's
libraries/AP_Logger/LogStructure.h, https://docs.px4.io/main/en/dev_log/ulog_file_format.html
"""
import pathlib
import random
import struct
import sys

from lines import line_of, line_of_bytes

folder = pathlib.Path(sys.argv[1])
randoms = random.Random(1)
INTEGERS = {"b": 8, "h": 16, "i": 32, "q": 64}
FLOATS = [float("nan"), -0.0, float("inf"), -float("inf"), 5e-324, 0.1, 2.0**53 + 2, 1.7976931348623157e308]
TEXTS = ["", "plain", "zwölf ☃", "a=b c;d"]
KINDS = ["least", "greatest", "odd", "odd", "any", "any"]


def number(code, how):
    """As struct packs and unpacks it: so of 32 bits of a float what is left of it."""
    if code == "?":
        return how == "greatest" or how != "least" and randoms.random() < 0.5
    if bits := INTEGERS.get(code.lower()):
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if code.islower() else (0, (1 << bits) - 1)
        return {"least": low, "greatest": high}.get(how, randoms.randint(low, high))
    value = randoms.choice(FLOATS) if how == "odd" else randoms.uniform(-1e4, 1e4)
    if code != "d" and 1e4 < abs(value) < float("inf"):
        value = 0.0
    return struct.unpack("<" + code, struct.pack("<" + code, value))[0]


def text(how):
    return "" if how == "least" else randoms.choice(TEXTS)


def write(name, data, lines):
    (folder / name).write_bytes(data)
    (folder / f"{name}.lines").write_text("\n".join(lines) + "\n")


# ---- WPILOG ----

WPI_CODES = {"bool": "?", "int8": "b", "uint8": "B", "int16": "h", "uint16": "H", "int32": "i", "uint32": "I", "int64": "q",
             "uint64": "Q", "float": "f", "float32": "f", "double": "d", "float64": "d"}
INNER = "double x;;uint8 small ; char name[5];"
OUTER = " ;".join([*(f"{kind} one_{kind}; {kind} two_{kind} [ 2 ]" for kind in WPI_CODES), "Inner inner", "Inner inners[2]",
                   "enum {a=1, b = 2,} int8 choice", "{c=3}uint16 other", "char letter", "char word[8]"])
# Bits as struct.adoc packs them: (declaration, name, bits, width of the integer in bytes, whether it begins a new one).
BITS = [("uint8 a:4", "a", 4, 1, True), ("int8 b : 2", "b", -2, 1, False), ("bool c:1", "c", 1, 1, False),
        ("int16 d:1", "d", -1, 2, True), ("int16 e:4", "e", -4, 2, False), ("uint16 f:5", "f", 5, 2, False),
        ("bool g:1", "g", 1, 2, False), ("int16 h:7", "h", -7, 2, True), ("enum{x=1}uint32 i:31", "i", 31, 4, True),
        ("uint32 j:2", "j", 2, 4, True), ("uint64 k:64", "k", 64, 8, True), ("int64 l:33", "l", -33, 8, True)]
BITS_SCHEMA = "bool first:1; bool second:1; int16 between; " + "; ".join(one[0] for one in BITS) + "; bool last:1; int8 end:8"


def with_length(value):
    raw = value.encode()
    return struct.pack("<I", len(raw)) + raw


def inner_of(how, before):
    x, small, name = number("d", how), number("B", how), text(how).encode()[:5].decode(errors="ignore").encode()
    return struct.pack("<dB5s", x, small, name), [(before + "x", x), (before + "small", small), (before + "name", name)]


def outer_of(how, before=""):
    payload, fields = b"", []
    for kind, code in WPI_CODES.items():
        for name, count in (f"one_{kind}", None), (f"two_{kind}", 2):
            for i in range(count or 1):
                value = number(code, how)
                payload += struct.pack("<" + code, value)
                fields.append((before + name + ("" if count is None else f"[{i}]"), value))
    for name in "inner.", "inners[0].", "inners[1].":
        raw, more = inner_of(how, before + name)
        payload, fields = payload + raw, fields + more
    choice, other, letter, word = number("b", how), number("H", how), b"Z", text(how).encode()[:8].decode(errors="ignore").encode()
    payload += struct.pack("<bH", choice, other) + letter + struct.pack("8s", word)
    return payload, fields + [(before + "choice", choice), (before + "other", other), (before + "letter", letter), (before + "word", word)]


def bits_of(how):
    fields, integers = [], []  # (bits so far, their number, width)

    def put(name, bits, width, is_new):
        is_signed, bits = bits < 0, abs(bits)
        low, high = (-(1 << bits - 1), (1 << bits - 1) - 1) if is_signed else (0, (1 << bits) - 1)
        value = {"least": low, "greatest": high}.get(how, randoms.randint(low, high))
        if is_new:
            integers.append([0, 0, width])
        integers[-1][0] |= (value & (1 << bits) - 1) << integers[-1][1]
        integers[-1][1] += bits
        fields.append((name, value))

    put("first", 1, 1, True)
    put("second", 1, 1, False)
    between = number("h", how)
    fields.append(("between", between))
    integers.append([between & 0xFFFF, 16, 2])
    for _, *one in BITS:
        put(*one)
    put("last", 1, 8, False)
    put("end", -8, 1, True)
    return b"".join(held.to_bytes(width, "little") for held, _, width in integers), fields


class Wpilog:
    def __init__(self, extra, is_longest):
        self.data = b"WPILOG" + struct.pack("<H", 0x0100) + with_length(extra)
        self.lines, self.is_longest, self.time_us, self.entries = [], is_longest, 0, {}

    def record(self, entry, payload):
        sizes = []
        for value, most in (entry, 4), (len(payload), 4), (self.time_us, 7):
            sizes.append(most if self.is_longest else max(1, (value.bit_length() + 7) // 8))
        self.data += bytes([sizes[0] - 1 | sizes[1] - 1 << 2 | sizes[2] - 1 << 4])
        for value, size in zip((entry, len(payload), self.time_us), sizes):
            self.data += value.to_bytes(size, "little")
        self.data += payload

    def start(self, entry, name, kind, about=""):
        self.entries[entry] = name
        self.record(0, b"\0" + struct.pack("<I", entry) + with_length(name) + with_length(kind) + with_length(about))

    def value(self, entry, payload, fields):
        self.time_us += randoms.randrange(1, 3000)
        self.record(entry, payload)
        name, time_ns = self.entries[entry], self.time_us * 1000
        self.lines.append(line_of_bytes(name, time_ns, payload) if fields is None else line_of(name, time_ns, fields))


def wpilog(name, extra="", is_longest=False):
    log, one = Wpilog(extra, is_longest), {"boolean": "?", "int64": "q", "float": "f", "double": "d"}
    entry = 250  # from one byte into two
    log.start(1, "NT:/.schema/struct:Outer", "structschema")
    log.start(2, "/.schema/struct:Inner", "structschema")
    log.start(3, "/.schema/struct:Bits", "structschema")
    log.start(4, "/early", "struct:Outer")
    log.value(4, outer_of("any")[0], None)  # its schema is not known yet
    for number_, schema in (1, OUTER), (2, INNER), (3, BITS_SCHEMA):
        log.value(number_, schema.encode(), [("value", schema.encode())])
    for how in KINDS:
        for kind, code in one.items():
            entry += 1
            log.start(entry, f"/{kind}/{how}/{entry}", kind, '{"source": "NT"}')
            value = number(code, how)
            log.value(entry, struct.pack("<" + code, value), [("value", value)])
            log.record(0, b"\2" + struct.pack("<I", entry) + with_length('{"source": "other"}'))
            entry += 1
            log.start(entry, f"/{kind}[]/{how}/{entry}", f"{kind}[]")
            values = [number(code, how) for _ in range(0 if how == "least" else 3)]
            log.value(entry, struct.pack(f"<{len(values)}{code}", *values), [(f"value[{i}]", v) for i, v in enumerate(values)])
        for kind in "string", "json":
            entry += 1
            log.start(entry, f"/{kind}/{entry}", kind)
            value = text(how).encode()
            log.value(entry, value, [("value", value)])
        entry += 1
        log.start(entry, f"/texts/{entry}", "string[]")
        values = [text(how) for _ in range(0 if how == "least" else 3)]
        log.value(entry, struct.pack("<I", len(values)) + b"".join(map(with_length, values)),
                  [(f"value[{i}]", v.encode()) for i, v in enumerate(values)])
        entry += 1
        log.start(entry, f"/outer/{entry}", "struct:Outer")
        log.value(entry, *outer_of(how))
        entry += 1
        log.start(entry, f"/outers/{entry}", "struct:Outer[]")
        both = [outer_of(how, f"value[{i}].") for i in range(0 if how == "least" else 2)]
        log.value(entry, b"".join(raw for raw, _ in both), sum((fields for _, fields in both), []))
        entry += 1
        log.start(entry, f"/bits/{entry}", "struct:Bits")
        log.value(entry, *bits_of(how))
        for kind in "raw", "msgpack", "proto:wpi.proto.Pose2d", "photonstruct:Thing:1.0", "struct:Unknown":
            entry += 1
            log.start(entry, f"/{kind}/{entry}", kind)
            log.value(entry, randoms.randbytes(7), None)
        # What is finished has no more values; under the same number another begins.
        log.record(0, b"\1" + struct.pack("<I", entry))
        log.record(entry, b"lost")
        log.start(entry, f"/again/{how}", "int64")
        log.value(entry, struct.pack("<q", -5), [("value", -5)])
    log.time_us = 1 << 50
    log.value(entry, struct.pack("<q", 6), [("value", 6)])
    write(name, log.data, log.lines)


# ---- DataFlash ----

FIELD_CODES = dict(b="b", B="B", h="h", H="H", i="i", I="I", f="f", d="d", q="q", Q="Q", M="B", g="e", c="h", C="H", e="i", E="I", L="i")
SCALES = dict(c=0.01, C=0.01, e=0.01, E=0.01, L=1e-7)
TEXT_SIZES = dict(n=4, N=16, Z=64)


class DataFlash:
    def __init__(self):
        self.data, self.lines, self.formats, self.time_ns, self.instances = b"", [], {}, 0, {}
        self.formats[128] = ("FMT", "BBnNZ", "Type,Length,Name,Format,Columns")
        self.define(128, *self.formats[128])

    def define(self, kind, name, codes, columns):
        self.formats[kind] = (name, codes, columns)
        length = 3 + sum(TEXT_SIZES.get(c) or (64 if c == "a" else struct.calcsize("<" + FIELD_CODES[c])) for c in codes)
        self.message(128, [kind, length, name, codes, columns])

    def message(self, kind, values, how_time=None):
        name, codes, columns = self.formats[kind]
        labels = columns.split(",") if columns else []
        payload, fields = b"", []
        for i, (code, value) in enumerate(zip(codes, values)):
            label = labels[i] if i < len(labels) else f"field{i}"
            if code in TEXT_SIZES:
                raw = value if isinstance(value, bytes) else value.encode()
                payload += struct.pack(f"{TEXT_SIZES[code]}s", raw)
                fields.append((label, raw[: TEXT_SIZES[code]].split(b"\0")[0]))
            elif code == "a":
                payload += struct.pack("<32h", *value)
                fields += [(f"{label}[{n}]", one) for n, one in enumerate(value)]
            else:
                payload += struct.pack("<" + FIELD_CODES[code], value)
                fields.append((label, value * SCALES[code] if code in SCALES else value))
        if how_time is not None:
            self.time_ns = how_time
        topic = name if kind not in self.instances else f"{name}[{values[self.instances[kind]]}]"
        self.data += b"\xa3\x95" + bytes([kind]) + payload
        self.lines.append(line_of(topic, self.time_ns, fields))


def dataflash(name):
    log = DataFlash()
    log.define(10, "UNIT", "QbZ", "TimeUS,Id,Label")
    log.define(11, "MULT", "Qbd", "TimeUS,Id,Mult")
    log.define(12, "FMTU", "QBNN", "TimeUS,FmtType,UnitIds,MultIds")
    numbers = "".join(code for code in FIELD_CODES)[:15]
    log.define(20, "NUMS", "Q" + numbers, "TimeUS," + ",".join(f"F{i}" for i in range(15)))
    log.define(21, "MORE", "Q" + "".join(FIELD_CODES)[15:] + "nNZa", "TimeUS,E,L,Four,Long,Most,Many")
    log.define(22, "IMU", "QBf", "TimeUS,I,GyrX")
    log.define(23, "OLD", "Ih", "TimeMS,Thing")
    log.define(24, "GPS", "BIHI", "Status,TimeMS,Week,T")  # of old logs: T is the log's own clock
    log.define(25, "NONE", "hh", "")  # without labels, and without a time
    log.message(10, [5, ord("s"), "s"], 5000)
    log.message(11, [6, ord("F"), 1e-6], 6000)
    log.message(12, [7, 22, "s#E", "F--"], 7000)
    log.instances[22] = 1
    for i, how in enumerate(KINDS):
        time_us = 10_000 * (i + 1)
        log.message(20, [time_us, *(number(FIELD_CODES[code], how) for code in numbers)], time_us * 1000)
        log.message(21, [time_us, *(number(FIELD_CODES[code], how) for code in "".join(FIELD_CODES)[15:]), "abcd" if i % 2 else "ab",
                         text(how).encode()[:16], text(how) * 3, [number("h", how) for _ in range(32)]], time_us * 1000)
        for instance in 0, 1, 7:
            log.message(22, [time_us, instance, number("f", how)], time_us * 1000)
        log.message(23, [time_us // 1000, number("h", how)], time_us * 1000)
        log.message(24, [3, 123456, 2000, time_us // 1000 + 1], time_us * 1000 + 1_000_000)
        log.message(25, [number("h", how), number("h", how)])
    write(name, log.data, log.lines)


# ---- ULog ----

ULOG_CODES = dict(int8_t="b", uint8_t="B", int16_t="h", uint16_t="H", int32_t="i", uint32_t="I", int64_t="q", uint64_t="Q", float="f",
                  double="d", bool="?")


class Ulog:
    def __init__(self):
        self.data, self.lines = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 77), []

    def put(self, kind, payload):
        self.data += struct.pack("<Hc", len(payload), kind.encode()) + payload

    def value(self, number_, topic, time_us, payload, fields):
        self.put("D", struct.pack("<HQ", number_, time_us) + payload)
        self.lines.append(line_of(topic, time_us * 1000, [("timestamp", time_us), *fields]))


def deep_of(how, before):
    """With a timestamp, for @foxglove/ulog takes nothing without."""
    values = [("timestamp", "Q"), ("a", "h"), ("b", "f")]
    fields = [(before + name, number(code, how)) for name, code in values]
    return struct.pack("<Qhf", *(value for _, value in fields)), fields


def numbers_of(how):
    payload, fields = b"", []
    for kind, code in ULOG_CODES.items():
        for name, count in (f"one_{kind}", None), (f"three_{kind}", 3):
            for i in range(count or 1):
                value = number(code, how)
                payload += struct.pack("<" + code, value)
                fields.append((name + ("" if count is None else f"[{i}]"), value))
        payload += b"\xee" * 3  # padding, as the definition says
    word = text(how).encode()[:10].decode(errors="ignore").encode()
    payload += struct.pack("10s", word)
    fields.append(("word", word))
    for name in "deep.", "deeps[0].", "deeps[1].":
        raw, more = deep_of(how, name)
        payload, fields = payload + raw, fields + more
    return payload, fields


def ulog(name, is_appended=False):
    log = Ulog()
    at = len(log.data) + 3 + 16  # of the places of appended data
    log.put("B", bytes(8) + bytes([is_appended]) + bytes(7) + bytes(24))
    log.put("I", bytes([14]) + b"char[3] sysABCabc"[:14] + b"PX4")
    log.put("M", bytes([0, 11]) + b"char[2] log" + b"ab")
    log.put("P", bytes([11]) + b"int32_t ABC" + struct.pack("<i", -5))
    log.put("Q", bytes([1, 11]) + b"int32_t ABC" + struct.pack("<i", -5))
    fields = ";".join(f"{kind} one_{kind};{kind}[3] three_{kind};uint8_t[3] _padding{i}" for i, kind in enumerate(ULOG_CODES))
    log.put("F", f"numbers:uint64_t timestamp;{fields};char[10] word;deep deep;deep[2] deeps;".encode())
    log.put("F", b"deep:uint64_t timestamp;int16_t a;float b;")
    log.put("F", b"tail:uint64_t timestamp;uint8_t last;uint8_t[7] _padding0;")  # padding at the end is not written
    for instance, number_, topic in (0, 0, "numbers"), (2, 1, "numbers"), (0, 300, "tail"):
        log.put("A", struct.pack("<BH", instance, number_) + topic.encode())
    time_us = 1000
    for i, how in enumerate(KINDS):
        for number_, topic in (0, "numbers"), (1, "numbers[2]"):
            time_us += randoms.randrange(1, 5000)
            log.value(number_, topic, time_us, *numbers_of(how))
        log.value(300, "tail", time_us, bytes([i]), [("last", i)])
        log.put("L", b"6" + struct.pack("<Q", time_us) + "said ☃".encode())
        log.put("C", b"6" + struct.pack("<HQ", 3, time_us) + b"tagged")
        log.put("S", bytes.fromhex("2f731320250cbb12"))
        log.put("O", struct.pack("<H", 12))
        log.put("P", bytes([11]) + b"int32_t ABC" + struct.pack("<i", i))
    if is_appended:
        log.data = log.data[:at] + struct.pack("<Q", len(log.data)) + log.data[at + 8 :]
    else:
        log.put("R", struct.pack("<H", 300))
    for how in KINDS[-2:]:
        time_us += 100
        log.value(1, "numbers[2]", time_us, *numbers_of(how))
    write(name, log.data, log.lines)


wpilog("short.wpilog")
wpilog("long.wpilog", extra="AdvantageKit ö", is_longest=True)
dataflash("all.bin")
ulog("all.ulg")
ulog("appended.ulg", is_appended=True)
