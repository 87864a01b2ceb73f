"""dump_rows.py FILE.db3: a rosbag2 database for dump_log.mjs: lines "definition type text" of what it defines, in
hexadecimal, then its rows, "topic type time_ns bytes"."""
import sqlite3
import sys

database = sqlite3.connect(f"file:{sys.argv[1]}?immutable=1", uri=True)
if database.execute("SELECT 1 FROM sqlite_master WHERE name = 'message_definitions'").fetchone():
    for kind, text in database.execute("SELECT topic_type, encoded_message_definition FROM message_definitions "
                                       "WHERE encoding = 'ros2msg'"):
        print("definition", kind, text.encode().hex())
for topic, kind, time, data in database.execute(
        "SELECT name, type, timestamp, data FROM messages JOIN topics ON topic_id = topics.id ORDER BY messages.id"):
    print(topic, kind, time, data.hex())
