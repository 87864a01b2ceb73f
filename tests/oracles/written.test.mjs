// Logs that other libraries wrote, with every option of their formats: what Trundle decodes of each field of each message is
// what they were given, and what they themselves decode; and logs that Trundle wrote. Files stay in the folder "written".
import assert from "node:assert/strict";
import { execFileSync } from "node:child_process";
import { existsSync, mkdirSync, readdirSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { dirname, join } from "node:path";
import { test } from "node:test";
import lz4 from "lz4js";
import zstd from "@foxglove/wasm-zstd";
import { McapWriter } from "@mcap/core";
import { all, countFields, difference, ourLines } from "./compare.mjs";
import { lineOf, lineOfBytes } from "./lines.mjs";
import { commonChannels, messagesOf, ros1Channel, ros2Channels, secondChannels } from "./messages.mjs";
import { mcapLines, theirLines } from "./read.mjs";

const written = join(process.cwd(), "written"), scripts = process.env.TRUNDLE_ORACLES, python3 = process.env.TRUNDLE_PYTHON;
rmSync(written, { recursive: true, force: true });

function place(...names) {
  const path = join(written, ...names);
  mkdirSync(dirname(path), { recursive: true });
  return path;
}

/// Trundle decodes a log as `given`; and so do the others of `theirs`, by their names.
async function sameOf(t, log, given, theirs = {}) {
  const { lines, said } = await ourLines(log);
  assert.equal(difference(lines, given), undefined, `${log}: given | ${said}`);
  for (const [name, other] of Object.entries(theirs))
    assert.equal(difference(lines, await all(other)), undefined, `${log}: ${name}`);
  t.diagnostic(`${log.slice(written.length + 1)}: ${lines.length} messages, ${countFields(lines)} fields`);
  return said;
}

// ---- MCAP ----

/// Bytes that no one decodes: of a channel without schema, in other encodings, and what Trundle says that it refuses.
const otherChannels = [["/json", "json", "jsonschema", '{"type": "object"}', '{"x": 1.5, "y": [2, "ö"]}'],
  ["/protobuf", "protobuf", "protobuf", "\x01\x02", "\x08\x96\x01"], ["/without_schema", "cdr", undefined, "", "\0\x01\0\0abcd"],
  ["/other_schema", "cdr", "omgidl", "struct A { long b; };", "\0\x01\0\0abcd"],
  ["/wide_text", "cdr", "ros2msg", "int32 before\nwstring text\nint32 behind\n", "\0\x01\0\0abcd\x01\0\0\0a\0\0\0abcd"],
  ["/parameter_list", "cdr", "ros2msg", "int32 one\n", "\0\x03\0\0\x01\0\x04\0abcd\x01\0\0\0"]];

const givenLines = (messages) => messages.map(({ channel, time, message, bytes }) =>
  message ? lineOf(channel.topic, time, channel.decoder, message) : lineOfBytes(channel.topic, time, bytes));

class Memory {
  bytes = [];
  size = 0;
  position = () => BigInt(this.size);
  async write(bytes) {
    this.bytes.push(Uint8Array.from(bytes));
    this.size += bytes.length;
  }
}

async function mcapOf(messages, options) {
  const writable = new Memory();
  const writer = new McapWriter({ writable, ...options });
  await writer.start({ profile: "", library: "oracle" });
  const ids = new Map();
  await writer.addMetadata({ name: "about", metadata: new Map([["robot", "Ödön"]]) });
  let sequence = 0;
  for (const { channel, time, bytes } of messages) {
    if (!ids.has(channel)) {
      const schemaId = channel.language === undefined ? 0 : await writer.registerSchema(
        { name: channel.type, encoding: channel.language, data: Buffer.from(channel.text, "utf8") });
      ids.set(channel, await writer.registerChannel(
        { schemaId, topic: channel.topic, messageEncoding: channel.encoding, metadata: new Map([["qos", "- depth: 1"]]) }));
    }
    await writer.addMessage({ channelId: ids.get(channel), sequence: sequence++, logTime: time, publishTime: time - 5n, data: bytes });
    if (sequence === 9)
      await writer.addAttachment({ name: "map.pgm", logTime: time, createTime: time, mediaType: "image/x", data: new Uint8Array(70000) });
  }
  await writer.end();
  return Buffer.concat(writable.bytes);
}

await zstd.isLoaded;
const compressions = {
  none: undefined,
  lz4: (data) => ({ compression: "lz4", compressedData: lz4.compress(data) }),
  zstd: (data) => ({ compression: "zstd", compressedData: new Uint8Array(zstd.compress(data)) }),
};
const [none, everything] = [false, true].map((is) => ({ useStatistics: is, useSummaryOffsets: is, repeatSchemas: is,
  repeatChannels: is, useAttachmentIndex: is, useMetadataIndex: is, useMessageIndex: is, useChunkIndex: is }));
const ends = { whole: everything, without_index: { ...everything, useMessageIndex: false, useChunkIndex: false },
  without_statistics: { ...everything, useStatistics: false }, without_summary: none, not_closed: none };
const sizeOfEnd = 9 + 4 + 9 + 20 + 8;  // of a file without summary: end of data, footer, magic

const rosMessages = messagesOf([ros1Channel, ...ros2Channels, ...secondChannels]);
const mcapMessages = [...rosMessages];
otherChannels.forEach(([topic, encoding, language, text, bytes], i) => mcapMessages.splice(5 * i, 0, { time: 1700000000000000000n,
  channel: { topic, encoding, language, text, type: "some/Thing" }, bytes: Buffer.from(bytes, "latin1") }));
const mcapLinesGiven = givenLines(mcapMessages);

for (const [compression, compressChunk] of [...Object.entries(compressions), ["no_chunks", undefined]])
  for (const [end, options] of Object.entries(ends))
    test(`MCAP by @mcap/core: ${compression}, ${end}`, async (t) => {
      const log = place("mcap", `${compression}_${end}.mcap`), useChunks = compression !== "no_chunks";
      const file = await mcapOf(mcapMessages, { ...options, useChunks, compressChunk, chunkSize: 30000 });
      const isClosed = end !== "not_closed";
      writeFileSync(log, isClosed ? file : file.subarray(0, file.length - sizeOfEnd));
      const theirs = { "@mcap/core as a stream": mcapLines(log, false) };
      if (options.useChunkIndex && useChunks) theirs["@mcap/core by its index"] = mcapLines(log, true);
      const said = await sameOf(t, log, mcapLinesGiven, theirs);
      assert.equal(/cut at byte/.test(said), !isClosed, said);
    });

test("MCAP: default values, by @foxglove/rosmsg2-serialization", async (t) => {
  const { default: ros2 } = await import("@foxglove/rosmsg2-serialization");
  const [channel] = ros2Channels, log = place("mcap", "defaults.mcap");
  const bytes = new ros2.MessageWriter(channel.decoder.definitions).writeMessage({});
  writeFileSync(log, await mcapOf([{ channel, time: 5n, bytes }], everything));
  await sameOf(t, log, [lineOf(channel.topic, 5n, channel.decoder, channel.decoder.read(bytes))]);
  const { lines: [line] } = await ourLines(log);
  for (const field of ["with_default=42", "with_defaults[1]=dc004000000000000", "flag_with_default=1",
    `text_with_default=s${Buffer.from("of this, # and that").toString("hex")}`]) assert.ok(line.includes(` ${field}`), field);
});

test("a difference is noticed", async () => {
  const messages = messagesOf([ros1Channel], 3), log = place("mcap", "other.mcap");
  const file = await mcapOf(messages, { ...none, useChunks: false });
  const given = givenLines(messages);
  file[file.indexOf(Buffer.from(messages[2].bytes))] ^= 1;
  writeFileSync(log, file);
  assert.match(difference((await ourLines(log)).lines, given), /3 messages, 3 expected; ours \| theirs: \/ros1 \d+: header\.seq=/);
});

// ---- rosbag2 ----

const hex = (bytes) => Buffer.from(bytes).toString("hex");

function writeRows(path, messages, { with_definitions = true, killed = false, compress = (bytes) => bytes } = {}) {
  const channels = [...new Set(messages.map(({ channel }) => channel))];
  const input = JSON.stringify({ path, with_definitions, killed,
    topics: channels.map(({ topic, type, language, text }) => ({ name: topic, type, language, text })),
    messages: messages.map(({ channel, time, bytes }) => [channels.indexOf(channel), String(time), hex(compress(bytes))]) });
  execFileSync(python3, [join(scripts, "write_rows.py")], { input });
}

const rowMessages = messagesOf(ros2Channels.filter(({ language }) => language === "ros2msg"));
const rowLinesGiven = givenLines(rowMessages);
const sameRows = (t, log, given = rowLinesGiven) => sameOf(t, log, given, { "Python's sqlite3": theirLines(log) });
const compressed = (path, to = `${path}.zstd`) => execFileSync("zstd", ["-q", "--rm", path, "-o", to]);

/// As rosbag2 writes it, with other things around the names of the files.
const metadata = (names, mode) => `rosbag2_bagfile_information:
  version: 5
  storage_identifier: sqlite3
  duration:
    nanoseconds: 700000007
  compression_format: "${mode === "" ? "" : "zstd"}"
  compression_mode: "${mode}"
  relative_file_paths:
${names.map((name) => `    - ${name}\n`).join("")}  files:
    - path: elsewhere.db3
      message_count: 1
`;

for (const [name, options] of Object.entries({ plain: {}, killed: { killed: true }, compressed_messages: { compress: zstd.compress } }))
  test(`rosbag2 by Python's sqlite3: ${name}`, async (t) => {
    const log = place("rosbag2", `${name}.db3`);
    writeRows(log, rowMessages, options);
    assert.equal(existsSync(`${log}-wal`), name === "killed");
    await sameRows(t, log);
  });

test("rosbag2 by Python's sqlite3: definitions in IDL", async (t) => {
  const log = place("rosbag2", "idl.db3"), messages = messagesOf(ros2Channels.filter(({ language }) => language === "ros2idl"));
  writeRows(log, messages);
  await sameRows(t, log, givenLines(messages));
});

test("rosbag2 by Python's sqlite3: a file compressed by zstd", async (t) => {
  const log = place("rosbag2", "file.db3");
  writeRows(log, rowMessages);
  compressed(log);
  await sameRows(t, `${log}.zstd`);
});

// A recording of two pieces in a folder. Compressed, rosbag2 names them with the ending or, some versions, without.
for (const [name, compresses, ending] of [["two_pieces", false, ""], ["compressed", true, ".zstd"], ["compressed_old", true, ""],
  ["without_metadata", false, undefined], ["compressed_without_metadata", true, undefined]])
  test(`rosbag2 by Python's sqlite3: a folder, ${name}`, async (t) => {
    const folder = dirname(place("rosbag2", name, "any")), half = rowMessages.length / 2;
    const files = [0, 1].map((i) => `${name}_${i}.db3`);
    files.forEach((file, i) => {
      writeRows(join(folder, file), rowMessages.slice(i * half, (i + 1) * half));
      if (compresses) compressed(join(folder, file));
    });
    if (ending !== undefined)
      writeFileSync(join(folder, "metadata.yaml"), metadata(files.map((file) => file + ending), compresses ? "FILE" : ""));
    await sameRows(t, folder);
  });

test("rosbag2 of Humble, without definitions: every type that @foxglove/rosmsg-msgs-common has", async (t) => {
  const log = place("rosbag2", "humble.db3"), messages = messagesOf(commonChannels, 6);
  writeRows(log, messages, { with_definitions: false });
  const { lines, said } = await ourLines(log);
  // What is built in, and nothing else, is decoded.
  const unknown = new Set([...said.matchAll(/^(\/\S+): the type/gm)].map(([, topic]) => topic));
  const given = messages.map(({ channel, time, message, bytes }) => unknown.has(channel.topic)
    ? lineOfBytes(channel.topic, time, bytes) : lineOf(channel.topic, time, channel.decoder, message));
  assert.equal(difference(lines, given), undefined, said);
  const promised = /^\/(std_msgs|geometry_msgs|nav_msgs|sensor_msgs|tf2_msgs)\//;
  assert.deepEqual([...unknown].filter((topic) => promised.test(topic)), []);
  const packages = new Set([...unknown].map((topic) => topic.split("/")[1]));
  t.diagnostic(`${(commonChannels.length - unknown.size) / 2} of ${commonChannels.length / 2} types, ${lines.length} messages, ` +
    `${countFields(lines)} fields; not built in are some of ${[...packages].join(", ")}`);
});

// ---- what scripts in Python write, with the lines of what they wrote ----

const python = (script, args, env = {}) => execFileSync(python3, [join(scripts, script), ...args], { env: { ...process.env, ...env } });
const linesBeside = (log) => readFileSync(log.replace(/(\.bag)?$/, ".lines"), "utf8").trimEnd().split("\n");

const rosbag = process.env.TRUNDLE_ROSBAG;
test("ROS 1 bags by python3-rosbag", { skip: !rosbag && "no python3-rosbag" }, async (t) => {
  const definition = place("bag", "definition.msg"), folder = dirname(definition);
  writeFileSync(definition, ros1Channel.text);
  python("write_bag.py", [folder, definition], { PYTHONPATH: join(rosbag, "usr/lib/python3/dist-packages"),
    LD_LIBRARY_PATH: readdirSync(join(rosbag, "usr/lib")).filter((name) => name.includes("-linux-"))
      .map((name) => join(rosbag, "usr/lib", name)).join(":") });
  for (const log of readdirSync(folder).filter((name) => name.endsWith(".bag")).map((name) => join(folder, name))) {
    const isClosed = !log.includes("not_closed");  // what is not @foxglove/rosbag does not read
    const said = await sameOf(t, log, linesBeside(log), isClosed ? { "@foxglove/rosbag": theirLines(log) } : {});
    assert.equal(/cut at byte/.test(said), !isClosed, said);
  }
});

test("WPILOG, DataFlash and ULog by a writer of our own, read by others", async (t) => {
  const folder = dirname(place("packed", "any"));
  python("write_packed.py", [folder]);
  for (const log of readdirSync(folder).filter((name) => !name.endsWith(".lines")).map((name) => join(folder, name)))
    // @foxglove/ulog leaves out what was appended after a crash.
    await sameOf(t, log, linesBeside(log), log.includes("appended") ? {} : { "who reads it": theirLines(log) });
});

// ---- the other way round: what Trundle writes ----

for (const format of ["mcap", "wpilog"])
  test(`${format} that trundle run --export writes`, async (t) => {
    const folder = dirname(place("exported", format, "any")), drive = join(scripts, "../../data/demo/slip");
    execFileSync(process.env.TRUNDLE_PROGRAM, ["run", drive, "--robot", join(drive, "robot.toml"), "--export", format, "-o", folder]);
    const log = join(folder, `run.${format}`);
    const theirs = { "record by record": theirLines(log) };
    if (format === "mcap") theirs["as a stream"] = mcapLines(log, false);
    const { lines } = await ourLines(log);
    await sameOf(t, log, lines, theirs);
    assert.equal(lines.filter((line) => line.includes(" bytes=")).length, 0);
  });
