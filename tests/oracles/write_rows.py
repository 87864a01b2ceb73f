"""write_rows.py: databases as rosbag2 writes them, by Python's sqlite3, as standard input says in JSON: path, topics (name,
type, language and text of their definition), messages (number of the topic, time_ns, bytes in hexadecimal);
with_definitions: as since Iron; killed: the writer ends without closing, and all but the tables is in the file -wal."""
import json
import os
import sqlite3
import sys

wanted = json.load(sys.stdin)
database = sqlite3.connect(wanted["path"])
if wanted["killed"]:
    database.execute("PRAGMA journal_mode = WAL")
    database.execute("PRAGMA wal_autocheckpoint = 0")
database.executescript("""
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL, metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, serialization_format TEXT NOT NULL,
                    offered_qos_profiles TEXT NOT NULL, type_description_hash TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
""")
if wanted["with_definitions"]:
    database.execute("CREATE TABLE message_definitions(id INTEGER PRIMARY KEY, topic_type TEXT NOT NULL, encoding TEXT NOT NULL,"
                     " encoded_message_definition TEXT NOT NULL, type_description_hash TEXT NOT NULL)")
    database.executemany("INSERT INTO message_definitions VALUES (NULL, ?, ?, ?, '')",
                         {(topic["type"], topic["language"], topic["text"]) for topic in wanted["topics"]})
database.executemany("INSERT INTO topics VALUES (?, ?, ?, 'cdr', '', '')",
                     [(i + 1, topic["name"], topic["type"]) for i, topic in enumerate(wanted["topics"])])
database.executemany("INSERT INTO messages VALUES (NULL, ?, ?, ?)",
                     [(topic + 1, int(time), bytes.fromhex(data)) for topic, time, data in wanted["messages"]])
database.commit()
if wanted["killed"]:
    os._exit(0)
database.close()
