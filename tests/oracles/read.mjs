// What dump_log.cpp prints of a log, by libraries that share nothing with this project: @foxglove/rosbag for ROS 1 bags,
// @mcap/core for MCAP, Python's sqlite3 and the tool zstd for rosbag2, @foxglove/ulog for ULog, and for WPILOG and
// DataFlash, for which there is none, read_packed.py. Messages that nobody decodes are their bytes.
import { execFileSync, spawn } from "node:child_process";
import { closeSync, existsSync, mkdtempSync, openSync, readFileSync, readSync, rmSync, statSync } from "node:fs";
import { open } from "node:fs/promises";
import { tmpdir } from "node:os";
import { basename, join } from "node:path";
import { createInterface } from "node:readline";
import omgidl from "@foxglove/omgidl-parser";
import omg from "@foxglove/omgidl-serialization";
import ros2idl from "@foxglove/ros2idl-parser";
import rosbag from "@foxglove/rosbag";
import rosbagNode from "@foxglove/rosbag/node.js";
import rosmsg from "@foxglove/rosmsg";
import common from "@foxglove/rosmsg-msgs-common";
import ros1 from "@foxglove/rosmsg-serialization";
import ros2 from "@foxglove/rosmsg2-serialization";
import { MessageType, ULog } from "@foxglove/ulog";
import { FileReader } from "@foxglove/ulog/node.js";
import { McapIndexedReader, McapStreamReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
import { loadDecompressHandlers } from "@mcap/support";
import { lineOf, lineOfBytes, nanoseconds } from "./lines.mjs";

const scripts = process.env.TRUNDLE_ORACLES, python3 = process.env.TRUNDLE_PYTHON;

/// Definitions of a schema, that of its type, and what reads a message. XCDR2 is read by the parser for all of OMG's IDL,
/// XCDR1 by the one for what ROS 2 writes.
export function decoderOf(language, type, text, isSecond = false) {
  if (language === "ros2idl" && isSecond) {
    const definitions = omgidl.parseIDL(plainIdl(text)), name = type.replaceAll("/", "::");
    const reader = new omg.MessageReader(name, definitions);
    return { definitions, root: definitions.find((one) => one.name === name), read: (bytes) => reader.readMessage(bytes) };
  }
  let definitions = language === "ros2idl" ? ros2idl.parseRos2idl(text) : rosmsg.parse(text, { ros2: language === "ros2msg" });
  const root = language === "ros2idl" ? definitions.find((one) => one.name === type) : definitions[0];
  definitions = [root, ...definitions.filter((one) => one !== root)];
  const reader = language === "ros1msg" ? new ros1.MessageReader(definitions) : new ros2.MessageReader(definitions);
  return { definitions, root, read: (bytes) => reader.readMessage(bytes) };
}

/// Without the heads of sections.
export const plainIdl = (text) => text.replace(/^(=+|IDL: .*|#include .*)$/gm, "");

const isSecondOfCdr = (bytes) => bytes[1] >= 6;

const lineOfMessage = (topic, time, decoder, bytes) =>
  decoder ? lineOf(topic, time, decoder, decoder.read(bytes)) : lineOfBytes(topic, time, bytes);

async function* bagLines(path) {
  const handlers = await loadDecompressHandlers();
  const decompress = Object.fromEntries(["bz2", "lz4"].map((name) =>
    [name, (bytes, size) => handlers[name](bytes, BigInt(size))]));
  const file = new rosbagNode.FileReader(path);
  const bag = new rosbag.Bag(file, { parse: false, decompress });
  await bag.open();
  const decoders = new Map();
  for (const [id, connection] of bag.connections)
    decoders.set(id, decoderOf("ros1msg", connection.type, connection.messageDefinition));
  for await (const result of bag.messageIterator())
    yield lineOfMessage(result.topic, nanoseconds(result.timestamp), decoders.get(result.connectionId), result.data);
  await file.close();
}

/// Of a channel of MCAP with such messages: nothing where they are of no kind that is decoded.
function mcapDecoder(channel, schema, bytes) {
  const isRead = { ros1: ["ros1msg"], cdr: ["ros2msg", "ros2idl"] }[channel.messageEncoding]?.includes(schema?.encoding);
  if (!isRead) return undefined;
  const text = new TextDecoder().decode(schema.data);
  // Of texts of wide letters no two implementations are the same, parameter lists name their fields by numbers.
  const isRefused = /\bwstring\b/.test(text) || (channel.messageEncoding === "cdr" && [2, 10, 18].includes(bytes[1] & ~1));
  return isRefused ? undefined : decoderOf(schema.encoding, schema.name, text, isSecondOfCdr(bytes));
}

/// By way of the index, or record by record as a stream. Checksums are checked.
export async function* mcapLines(path, isIndexed) {
  const decompressHandlers = await loadDecompressHandlers();
  const decoders = new Map();
  const line = (message, channel, schema) => {
    if (!decoders.has(channel.id)) decoders.set(channel.id, mcapDecoder(channel, schema, message.data));
    return lineOfMessage(channel.topic, message.logTime, decoders.get(channel.id), message.data);
  };
  if (isIndexed) {
    const file = await open(path, "r");
    try {
      const reader = await McapIndexedReader.Initialize({ readable: new FileHandleReadable(file), decompressHandlers });
      for await (const message of reader.readMessages({ validateCrcs: true })) {
        const channel = reader.channelsById.get(message.channelId);
        yield line(message, channel, reader.schemasById.get(channel.schemaId));
      }
    } finally {
      await file.close();
    }
    return;
  }
  const reader = new McapStreamReader({ decompressHandlers, validateCrcs: true });
  reader.append(readFileSync(path));
  const schemas = new Map(), channels = new Map();
  for (let record; (record = reader.nextRecord());) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel") channels.set(record.id, record);
    if (record.type !== "Message") continue;
    const channel = channels.get(record.channelId);
    yield line(record, channel, schemas.get(channel.schemaId));
  }
}

/// Whether a file says where the messages of its chunks are.
async function hasIndex(path) {
  const file = await open(path, "r");
  try {
    const reader = await McapIndexedReader.Initialize({ readable: new FileHandleReadable(file) });
    return reader.chunkIndexes.some((chunk) => chunk.messageIndexLength > 0n);
  } catch {
    return false;
  } finally {
    await file.close();
  }
}

/// Definitions of a type and of what it uses, the type first.
function commonDefinitions(type) {
  const all = common.ros2humble;
  const found = [], names = new Set();
  const add = (name) => {
    if (names.has(name)) return true;
    const definition = all[name] ?? all[name.replace("/msg/", "/")];
    if (!definition) return false;
    names.add(name);
    found.push(definition);
    return definition.definitions.every((field) => !field.isComplex || add(field.type));
  };
  return add(type) ? found : undefined;
}

export function commonDecoder(type) {
  const definitions = commonDefinitions(type);
  if (!definitions) return undefined;
  const reader = new ros2.MessageReader(definitions);
  return { definitions, root: definitions[0], read: (bytes) => reader.readMessage(bytes) };
}

/// Lines that a program prints.
async function* linesFrom(program, ...args) {
  const child = spawn(program, args, { stdio: ["ignore", "pipe", "inherit"] });
  const ended = new Promise((resolve) => child.on("close", resolve));
  yield* createInterface({ input: child.stdout });
  if ((await ended) !== 0) throw new Error(`${program} ${args.join(" ")} failed`);
}

/// What rosbag2 compressed: a message or a whole file.
const isZstd = (bytes) => Buffer.from(bytes.subarray(0, 4)).equals(Buffer.from([0x28, 0xb5, 0x2f, 0xfd]));
const decompressed = (bytes) => execFileSync("zstd", ["-dqc"], { input: bytes, maxBuffer: 1 << 30 });

/// Rows of a database of rosbag2. Of one of Humble the definitions are those of @foxglove/rosmsg-msgs-common.
async function* rowLines(path) {
  const decoders = new Map();
  for await (const row of linesFrom(python3, join(scripts, "read_rows.py"), path)) {
    const [topic, type, time, data] = row.split(" ");
    if (topic === "definition") {
      const text = Buffer.from(data, "hex").toString();
      const isService = text.includes("\n---");  // no message is of its type
      if (text !== "" && !isService) decoders.set(type, decoderOf(time, type, text));
      continue;
    }
    if (!decoders.has(type)) decoders.set(type, commonDecoder(type));
    const bytes = Buffer.from(data, "hex");
    yield lineOfMessage(topic, time, decoders.get(type), isZstd(bytes) ? decompressed(bytes) : bytes);
  }
}

async function* ulogLines(path) {
  const file = new FileReader(path);
  const ulog = new ULog(file);
  await ulog.open();
  // Padding is no field, a text is one and no array.
  const all = [...ulog.header.definitions.values()].map(({ name, fields }) => ({
    name,
    definitions: fields.filter((field) => !field.name.startsWith("_padding"))
      .map((field) => ({ ...field, isArray: field.arrayLength !== undefined && field.type !== "char" })),
  }));
  try {
    for await (const message of ulog.readMessages()) {
      if (message.type !== MessageType.Data) continue;
      const { name, multiId } = ulog.subscriptions.get(message.msgId);
      const decoder = { definitions: all, root: all.find((one) => one.name === name) };
      const topic = multiId === 0 ? name : `${name}[${multiId}]`;
      yield lineOf(topic, message.value.timestamp * 1000n, decoder, message.value);
    }
  } finally {
    await file.close();
  }
}

function headOf(path) {
  const head = Buffer.alloc(16), file = openSync(path);
  readSync(file, head);
  closeSync(file);
  return head;
}

/// The pieces of a rosbag2 in its folder, in the order in which they were written.
function piecesOf(folder) {
  const metadata = join(folder, "metadata.yaml");
  const names = existsSync(metadata)
    ? readFileSync(metadata, "utf8").split("relative_file_paths:")[1].match(/- .*/g).map((item) => item.slice(2).trim())
    : [0, 1, 2].map((i) => `${basename(folder)}_${i}.db3`);
  const places = names.map((name) => join(folder, name));
  return places.map((place) => (existsSync(place) ? place : place + ".zstd")).filter((place) => existsSync(place));
}

export async function* theirLines(path) {
  if (statSync(path).isDirectory()) {
    for (const piece of piecesOf(path)) yield* theirLines(piece);
    return;
  }
  const head = headOf(path);
  const begins = (magic) => head.subarray(0, magic.length).toString("latin1") === magic;
  if (isZstd(head)) {
    const folder = mkdtempSync(join(tmpdir(), "oracle-"));
    try {
      const plain = join(folder, basename(path).replace(/\.zstd?$/, ""));
      execFileSync("zstd", ["-dqf", path, "-o", plain]);
      yield* theirLines(plain);
    } finally {
      rmSync(folder, { recursive: true });
    }
  } else if (begins("#ROSBAG")) yield* bagLines(path);
  else if (begins("\x89MCAP")) yield* mcapLines(path, await hasIndex(path));
  else if (begins("SQLite")) yield* rowLines(path);
  else if (begins("ULog")) yield* ulogLines(path);
  else yield* linesFrom(python3, join(scripts, "read_packed.py"), path);
}
