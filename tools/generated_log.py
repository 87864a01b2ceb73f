"""Small logs of every format, of one short drive of two wheels: what tools/mutation_campaign.py damages.

Chunks have no checksum and, but for one bag, no compression: so a damaged byte reaches what reads the message.
"""
import bz2
import math
import sqlite3
import struct

ROWS, STEP_S, START_S, TRACK_M, DIAMETER_M = 60, 0.1, 1.0, 0.5, 0.2

HEADER = "MSG: std_msgs/Header\n{}time stamp\nstring frame_id\n"
POSE = ("MSG: geometry_msgs/Pose\nPoint position\nQuaternion orientation\n", "MSG: geometry_msgs/Point\nfloat64 x\nfloat64 y\n"
        "float64 z\n", "MSG: geometry_msgs/Quaternion\nfloat64 x\nfloat64 y\nfloat64 z\nfloat64 w\n")
DEFINITIONS = {
    "sensor_msgs/JointState": ("Header header\nstring[] name\nfloat64[] position\nfloat64[] velocity\nfloat64[] effort\n",),
    "sensor_msgs/Imu": ("Header header\ngeometry_msgs/Quaternion orientation\nfloat64[9] orientation_covariance\n"
                        "geometry_msgs/Vector3 angular_velocity\nfloat64[9] angular_velocity_covariance\n"
                        "geometry_msgs/Vector3 linear_acceleration\nfloat64[9] linear_acceleration_covariance\n", POSE[2],
                        "MSG: geometry_msgs/Vector3\nfloat64 x\nfloat64 y\nfloat64 z\n"),
    "geometry_msgs/PoseStamped": ("Header header\nPose pose\n", *POSE),
}

URDF = """<?xml version="1.0"?>
<robot name="two_wheels">
  <joint name="left_wheel_joint" type="continuous"><parent link="base_link"/><child link="left_wheel"/>
    <origin xyz="0 0.25 0" rpy="-1.57 0 0"/></joint>
  <joint name="right_wheel_joint" type="continuous"><parent link="base_link"/><child link="right_wheel"/>
    <origin xyz="0 -0.25 0"/></joint>
  <link name="left_wheel"><visual><geometry><cylinder length="0.02" radius="0.1"/></geometry></visual></link>
  <link name="right_wheel"><collision><geometry><sphere radius='0.1'/></geometry></collision></link>
</robot>
"""
CONTROLLER = """base:
  ros__parameters:
    type: diff_drive_controller/DiffDriveController
    left_wheel_names: ["left_wheel_joint"]
    right_wheel_names:
      - right_wheel_joint
    wheel_separation: 0.5
    wheel_radius: 0.1
"""
ROBOT = "".join(f'[[wheel]]\nname = "{name}"\ny_m = {y}\ndiameter_m = {DIAMETER_M}\nrecorded_diameter_m = {DIAMETER_M}\n'
                for name, y in (("left", TRACK_M / 2), ("right", -TRACK_M / 2))) + "[gyro]\n"


def drive():
    """Of each row: its time, the travel of both wheels [m], the yaw rate [rad/s] and the pose."""
    left = right = x = y = heading = 0.0
    for row in range(ROWS):
        moves = ROWS // 6 < row < ROWS - ROWS // 6
        speed, rate = (0.5, 0.8 * math.sin(0.5 * row * STEP_S)) if moves else (0.0, 0.0)
        left, right = left + STEP_S * (speed - rate * TRACK_M / 2), right + STEP_S * (speed + rate * TRACK_M / 2)
        heading += STEP_S * rate
        x, y = x + STEP_S * speed * math.cos(heading), y + STEP_S * speed * math.sin(heading)
        yield START_S + row * STEP_S, left, right, rate, (x, y, heading)


class Ros1:
    """A message in ROS 1's serialization."""

    def __init__(self):
        self.bytes = b""

    def put(self, form, *values):
        self.bytes += struct.pack("<" + form, *values)
        return self

    def text(self, text):
        return self.put("I", len(text)).raw(text.encode())

    def raw(self, content):
        self.bytes += content
        return self

    def header(self, time):
        return self.put("I", 0).stamp(time).text("base_link")

    def stamp(self, time):
        return self.put("II", int(time), round(time % 1 * 1e9))

    def whole(self):
        return self.bytes


class Cdr(Ros1):
    """A message in CDR: aligned, texts with their zero, no sequence number in headers."""

    def put(self, form, *values):
        for letter, value in zip(form, values):
            size = struct.calcsize(letter)
            self.bytes += bytes(-len(self.bytes) % size) + struct.pack("<" + letter, value)
        return self

    def text(self, text):
        return self.put("I", len(text) + 1).raw(text.encode() + b"\0")

    def header(self, time):
        return self.stamp(time).text("base_link")

    def whole(self):
        return b"\0\1\0\0" + self.bytes


def ros_messages(writer):
    """Time, topic, type and bytes of each message."""
    for time, left, right, rate, (x, y, heading) in drive():
        joints = writer().header(time).put("I", 2).text("left_wheel_joint").text("right_wheel_joint")
        joints.put("I", 2).put("dd", 2 * left / DIAMETER_M, 2 * right / DIAMETER_M).put("I", 0).put("I", 0)
        yield time, "/joint_states", "sensor_msgs/JointState", joints.whole()
        imu = writer().header(time).put("dddd", 0, 0, 0, 1).put("d" * 9, *[0.0] * 9).put("ddd", 0, 0, rate)
        imu.put("d" * 9, *[0.0] * 9).put("ddd", 0, 0, 9.81).put("d" * 9, *[0.0] * 9)
        yield time, "/imu", "sensor_msgs/Imu", imu.whole()
        pose = writer().header(time).put("ddd", x, y, 0).put("dddd", 0, 0, math.sin(heading / 2), math.cos(heading / 2))
        yield time, "/pose", "geometry_msgs/PoseStamped", pose.whole()


def definition(kind, ros2):
    parts = [*DEFINITIONS[kind], HEADER.format("" if ros2 else "uint32 seq\n")]
    text = ("=" * 80 + "\n").join(parts)
    return text.replace("time stamp", "builtin_interfaces/Time stamp") + "=" * 80 + \
        "\nMSG: builtin_interfaces/Time\nint32 sec\nuint32 nanosec\n" if ros2 else text


# ---- ROS 1 ----

def length_and(content):
    return struct.pack("<I", len(content)) + content


def bag_record(fields, content):
    return length_and(b"".join(length_and(name.encode() + b"=" + value) for name, value in fields)) + length_and(content)


def bag(compressed=False):
    """Version 2.0, chunks of thirty messages with their indices."""
    connections, chunks, infos = {}, b"", b""

    def connection(topic, kind):
        inner = (("topic", topic.encode()), ("type", kind.encode()), ("md5sum", b"*"),
                 ("message_definition", definition(kind, False).encode()))
        return bag_record([("op", b"\x07"), ("conn", struct.pack("<I", connections[topic][0])), ("topic", topic.encode())],
                          b"".join(length_and(name.encode() + b"=" + value) for name, value in inner))

    messages = list(ros_messages(Ros1))
    for first in range(0, len(messages), 30):
        records = b""
        for time, topic, kind, content in messages[first:first + 30]:
            if topic not in connections:
                connections[topic] = (len(connections), kind)
                records += connection(topic, kind)
            stamp = struct.pack("<II", int(time), round(time % 1 * 1e9))
            records += bag_record([("op", b"\x02"), ("conn", struct.pack("<I", connections[topic][0])), ("time", stamp)], content)
        packed = bz2.compress(records) if compressed else records
        chunks += bag_record([("op", b"\x05"), ("compression", b"bz2" if compressed else b"none"),
                              ("size", struct.pack("<I", len(records)))], packed)
        chunks += bag_record([("op", b"\x04"), ("ver", struct.pack("<I", 1)), ("conn", struct.pack("<I", 0))], b"")
        counts = b"".join(struct.pack("<II", number, 10) for number, _ in connections.values())
        infos += bag_record([("op", b"\x06"), ("ver", struct.pack("<I", 1))], counts)
    magic = b"#ROSBAG V2.0\n"

    def head(index):
        return bag_record([("op", b"\x03"), ("index_pos", struct.pack("<Q", index)),
                           ("conn_count", struct.pack("<I", len(connections))), ("chunk_count", struct.pack("<I", 0))], b" " * 100)

    index = b"".join(connection(topic, kind) for topic, (_, kind) in connections.items())
    return magic + head(len(magic + head(0) + chunks)) + chunks + index + infos


# ---- MCAP and rosbag2 ----

def ros2_name(kind):
    return kind.replace("/", "/msg/")


def mcap():
    """Chunks of thirty messages, not compressed and with no sum."""
    def record(opcode, content):
        return struct.pack("<BQ", opcode, len(content)) + content

    channels, numbers = b"", {}
    messages = list(ros_messages(Cdr))
    for _, topic, kind, _ in messages[:3]:
        numbers[topic] = len(numbers)
        channels += record(3, Ros1().put("H", numbers[topic] + 1).text(ros2_name(kind)).text("ros2msg")
                           .text(definition(kind, True)).bytes)
        channels += record(4, Ros1().put("HH", numbers[topic], numbers[topic] + 1).text(topic).text("cdr").put("I", 0).bytes)
    file = b"\x89MCAP0\r\n" + record(1, Ros1().text("").text("").bytes)
    for first in range(0, len(messages), 30):
        records = b"" if first else channels
        for number, (time, topic, _, content) in enumerate(messages[first:first + 30], first):
            time_ns = round(time * 1e9)
            records += record(5, struct.pack("<HIQQ", numbers[topic], number, time_ns, time_ns) + content)
        file += record(6, struct.pack("<QQQI", 0, 0, len(records), 0) + length_and(b"") + struct.pack("<Q", len(records)) + records)
    file += record(15, struct.pack("<I", 0))
    return file + channels + record(2, struct.pack("<QQI", len(file), 0, 0)) + b"\x89MCAP0\r\n"


def write_rosbag2(path):
    """One database, as Humble writes it: without definitions."""
    database = sqlite3.connect(path)
    database.execute("PRAGMA page_size = 1024")
    database.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                     "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
    database.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, "
                     "data BLOB NOT NULL)")
    database.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
    numbers = {}
    for time, topic, kind, content in ros_messages(Cdr):
        if topic not in numbers:
            numbers[topic] = len(numbers) + 1
            database.execute("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '')", (numbers[topic], topic, ros2_name(kind)))
        database.execute("INSERT INTO messages VALUES (NULL, ?, ?, ?)", (numbers[topic], round(time * 1e9), content))
    database.commit()
    database.close()


# ---- those of controllers ----

def wpilog():
    out = b"WPILOG" + struct.pack("<H", 0x100) + length_and(b"")
    names = ("NT:/Drive/LeftDistanceMeters", "NT:/Drive/RightDistanceMeters", "NT:/Drive/Gyro/YawRateRadPerSec",
             "NT:/Drive/Modes", "NT:/Pose")
    kinds = ("double", "double", "double", "string[]", "struct:Pose2d")

    def record(number, time_us, content):  # lengths: 1 byte of the number, 2 of the size, 8 of the time
        return struct.pack("<BB", 0x74, number) + struct.pack("<H", len(content)) + \
            time_us.to_bytes(8, "little") + content

    for number, (name, kind) in enumerate(zip(names, kinds), 1):
        start = b"\0" + struct.pack("<I", number) + length_and(name.encode()) + length_and(kind.encode()) + length_and(b"")
        out += record(0, 0, start)
    for number, (name, schema) in enumerate((("Pose2d", "Translation2d translation;Rotation2d rotation"),
                                             ("Translation2d", "double x;double y"), ("Rotation2d", "double value")), 6):
        out += record(0, 0, b"\0" + struct.pack("<I", number) + length_and(b"/.schema/struct:" + name.encode()) +
                      length_and(b"structschema") + length_and(b""))
        out += record(number, 0, schema.encode())
    for time, left, right, rate, pose in drive():
        time_us = round(time * 1e6)
        for number, value in enumerate((left, right, rate), 1):
            out += record(number, time_us, struct.pack("<d", value))
        out += record(4, time_us, struct.pack("<I", 2) + length_and(b"auto") + length_and(b""))
        out += record(5, time_us, struct.pack("<ddd", *pose))
    return out


def dataflash():
    out = b""

    def message(kind, content):
        return b"\xa3\x95" + bytes([kind]) + content

    for kind, length, name, form, labels in (
            (128, 89, b"FMT", b"BBnNZ", b"Type,Length,Name,Format,Columns"), (129, 31, b"PARM", b"QNf", b"TimeUS,Name,Value"),
            (130, 21, b"WENC", b"QfBfB", b"TimeUS,Dist0,Qual0,Dist1,Qual1"), (131, 23, b"IMU", b"Qfff", b"TimeUS,GyrX,GyrY,GyrZ"),
            (132, 24, b"GPS", b"QLLeB", b"TimeUS,Lat,Lng,Alt,Status")):
        out += message(128, struct.pack("<BB4s16s64s", kind, length, name, form, labels))
    for name, value in ((b"WENC_RADIUS", 0.1), (b"WENC_CPR", 3200), (b"WENC_POS_Y", -0.25), (b"WENC2_RADIUS", 0.1),
                        (b"WENC2_POS_Y", 0.25)):
        out += message(129, struct.pack("<Q16sf", 1, name, value))
    for time, left, right, rate, (x, y, _) in drive():
        time_us = round(time * 1e6)
        out += message(130, struct.pack("<QfBfB", time_us, left, 100, right, 100))
        out += message(131, struct.pack("<Qfff", time_us, 0, 0, -rate))  # z points down
        out += message(132, struct.pack("<QiiiB", time_us, round(4.8e8 + 90 * x), round(1.1e8 + 134 * y), 5000, 3))
    return out


def ulog():
    def message(kind, content):
        return struct.pack("<Hc", len(content), kind) + content

    out = b"ULog\x01\x12\x35\x01" + struct.pack("<Q", 0) + message(b"B", bytes(40))
    out += message(b"F", b"wheel_encoders:uint64_t timestamp;float[2] wheel_speed;float[2] wheel_angle;")
    out += message(b"F", b"vehicle_angular_velocity:uint64_t timestamp;uint64_t timestamp_sample;float[3] xyz;")
    for number, name in enumerate((b"wheel_encoders", b"vehicle_angular_velocity")):
        out += message(b"A", struct.pack("<BH", 0, number) + name)
    for time, left, right, rate, _ in drive():
        time_us = round(time * 1e6)
        angles = 2 * right / DIAMETER_M, 2 * left / DIAMETER_M
        out += message(b"D", struct.pack("<HQffff", 0, time_us, 0, 0, *angles))
        out += message(b"D", struct.pack("<HQQfff", 1, time_us, time_us, 0, 0, -rate))
    return out


def write(folder):
    """drive.bag, bz2.bag, drive.mcap, drive.db3, drive.wpilog, drive.bin and drive.ulg; robot.urdf, controller.yaml and
    two_wheels.toml of their robot."""
    for name, content in (("drive.bag", bag()), ("bz2.bag", bag(compressed=True)), ("drive.mcap", mcap()),
                          ("drive.wpilog", wpilog()), ("drive.bin", dataflash()), ("drive.ulg", ulog()),
                          ("robot.urdf", URDF.encode()), ("controller.yaml", CONTROLLER.encode()),
                          ("two_wheels.toml", ROBOT.encode())):
        (folder / name).write_bytes(content)
    write_rosbag2(folder / "drive.db3")
