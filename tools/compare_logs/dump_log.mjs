// node dump_log.mjs FILE: what dump_log.cpp prints, by the libraries of Foxglove: @foxglove/rosbag for ROS 1 bags,
// @mcap/core for MCAP; of a .db3 (rows from dump_rows.py on stdin, with "-" as FILE) the definitions of
// @foxglove/rosmsg-msgs-common where it holds none. Messages that nobody knows are their bytes.
import { open } from "node:fs/promises";
import { createInterface } from "node:readline";
import rosbag from "@foxglove/rosbag";
import rosbagNode from "@foxglove/rosbag/node.js";
import rosmsg from "@foxglove/rosmsg";
import common from "@foxglove/rosmsg-msgs-common";
import ros1 from "@foxglove/rosmsg-serialization";
import ros2 from "@foxglove/rosmsg2-serialization";
import { McapIndexedReader } from "@mcap/core";
import { FileHandleReadable } from "@mcap/nodejs";
import { loadDecompressHandlers } from "@mcap/support";

const bits = new DataView(new ArrayBuffer(8));

function textOf(value, type) {
  if (typeof value === "string") return "s" + Buffer.from(value, "utf8").toString("hex");
  if (typeof value === "boolean") return value ? "1" : "0";
  if (typeof value === "bigint") return value.toString();
  if (type === "float32" || type === "float64") {
    if (Number.isNaN(value)) return "nan";
    bits.setFloat64(0, value);
    return "d" + bits.getBigUint64(0).toString(16).padStart(16, "0");
  }
  return String(value);
}

const nanoseconds = (time) => (BigInt(time.sec) * 1000000000n + BigInt(time.nsec ?? time.nanosec)).toString();

/// Appends " path=value" for each field of a message, in the order of its definition.
function append(definitions, definition, message, before, out) {
  for (const field of definition.definitions) {
    if (field.isConstant) continue;
    const path = before + field.name;
    const element = (value, at) => {
      if (field.type === "time" || field.type === "duration") out.push(`${at}=${nanoseconds(value)}`);
      else if (field.isComplex) {
        const inner = definitions.find((other) => other.name === field.type) ??
          definitions.find((other) => other.name?.endsWith("/" + field.type));
        append(definitions, inner, value, at + ".", out);
      } else out.push(`${at}=${textOf(value, field.type)}`);
    };
    const value = message[field.name];
    if (field.isArray) for (let i = 0; i < value.length; ++i) element(value[i], `${path}[${i}]`);
    else element(value, path);
  }
}

function lineOf(topic, time, decoder, bytes) {
  if (!decoder) return `${topic} ${time} bytes=${Buffer.from(bytes).toString("hex")}`;
  const out = [`${topic} ${time}`];
  append(decoder.definitions, decoder.root, decoder.reader.readMessage(bytes), "", out);
  return out.join(" ");
}

function decoderOf(definitions, isRos2) {
  const root = definitions[0];
  const reader = isRos2 ? new ros2.MessageReader(definitions) : new ros1.MessageReader(definitions);
  return { definitions, root, reader };
}

async function dumpBag(path, print) {
  const handlers = await loadDecompressHandlers();
  const decompress = Object.fromEntries(["bz2", "lz4"].map((name) =>
    [name, (bytes, size) => handlers[name](bytes, BigInt(size))]));
  const bag = new rosbag.Bag(new rosbagNode.FileReader(path), { parse: false, decompress });
  await bag.open();
  const decoders = new Map();
  for (const [id, connection] of bag.connections)
    decoders.set(id, decoderOf(rosmsg.parse(connection.messageDefinition), false));
  for await (const result of bag.messageIterator())
    print(lineOf(result.topic, nanoseconds(result.timestamp), decoders.get(result.connectionId), result.data));
}

async function dumpMcap(path, print) {
  const reader = await McapIndexedReader.Initialize({
    readable: new FileHandleReadable(await open(path, "r")),
    decompressHandlers: await loadDecompressHandlers(),
  });
  const decoders = new Map();
  for (const [id, channel] of reader.channelsById) {
    const schema = reader.schemasById.get(channel.schemaId);
    const definition = new TextDecoder().decode(schema.data);
    const isRos2 = schema.encoding !== "ros1msg";
    const definitions = rosmsg.parse(definition, { ros2: isRos2 });
    // An empty structure of ROS 2 has a byte, which is no field.
    decoders.set(id, decoderOf(definitions, isRos2));
  }
  for await (const message of reader.readMessages())
    print(lineOf(reader.channelsById.get(message.channelId).topic, message.logTime.toString(),
                 decoders.get(message.channelId), message.data));
}

/// Definitions of a type and of what it uses, the type first.
function commonDefinitions(type) {
  const all = common.ros2humble ?? common.ros2galactic;
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

async function dumpRows(print) {
  const decoders = new Map();
  for await (const line of createInterface({ input: process.stdin })) {
    const [topic, type, time, data] = line.split(" ");
    if (topic === "definition") {
      const text = Buffer.from(time, "hex").toString();
      const isService = text.includes("\n---");  // no message is of its type
      if (text !== "" && !isService) decoders.set(type, decoderOf(rosmsg.parse(text, { ros2: true }), true));
      continue;
    }
    if (!decoders.has(type)) {
      const definitions = commonDefinitions(type);
      decoders.set(type, definitions && decoderOf(definitions, true));
    }
    print(lineOf(topic, time, decoders.get(type), Buffer.from(data, "hex")));
  }
}

const path = process.argv[2];
let text = [];
const print = (line) => {
  text.push(line);
  if (text.length > 1000) process.stdout.write(text.splice(0).join("\n") + "\n");
};
if (path === "-") await dumpRows(print);
else if (path.endsWith(".mcap")) await dumpMcap(path, print);
else await dumpBag(path, print);
if (text.length > 0) process.stdout.write(text.join("\n") + "\n");
