"""read_rows.py FILE.db3: a rosbag2 database by Python's sqlite3, for read.mjs: lines "definition type encoding text" of
what it defines, the text in hexadecimal, then its rows, "topic type time_ns bytes"."""
import pathlib
import shutil
import sqlite3
import sys
import tempfile


def show(database):
    if database.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'").fetchone():
        for kind, encoding, text in database.execute(
                "SELECT topic_type, encoding, encoded_message_definition FROM message_definitions"):
            print("definition", kind, encoding, text.encode().hex())
    for topic, kind, time, data in database.execute(
            "SELECT name, type, timestamp, data FROM messages JOIN topics ON topic_id = topics.id ORDER BY messages.id"):
        print(topic, kind, time, data.hex())


path = pathlib.Path(sys.argv[1])
left = path.with_name(path.name + "-wal")
if left.exists():  # of a crash: SQLite recovers it, in a copy
    with tempfile.TemporaryDirectory() as folder:
        for file in path, left:
            shutil.copyfile(file, pathlib.Path(folder) / file.name)
        show(sqlite3.connect(pathlib.Path(folder) / path.name))
else:
    show(sqlite3.connect(f"file:{path}?immutable=1", uri=True))
