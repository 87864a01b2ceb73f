"""A message as dump_log.cpp prints it, for the scripts in Python: "topic time_ns", then " path=value" for each field."""
import math
import struct


def text_of(value):
    if isinstance(value, bytes):
        return "s" + value.hex()
    if isinstance(value, int):
        return str(int(value))
    return "nan" if math.isnan(value) else "d" + struct.pack(">d", value).hex()


def line_of(topic, time_ns, fields):
    return " ".join([f"{topic} {time_ns}", *(f"{path}={text_of(value)}" for path, value in fields)])


def line_of_bytes(topic, time_ns, payload):
    """Of a message that nobody decodes."""
    return f"{topic} {time_ns} bytes={payload.hex()}"
