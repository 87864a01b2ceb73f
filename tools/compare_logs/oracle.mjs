// What dump_log prints, by the libraries of others: node oracle.mjs FILE [--fields]
import { createHash } from "node:crypto";
import { readFileSync } from "node:fs";
import { McapStreamReader } from "@mcap/core";
import { loadDecompressHandlers } from "@mcap/support";
import { Bag } from "@foxglove/rosbag";
import { FileReader } from "@foxglove/rosbag/node.js";
import { parse } from "@foxglove/rosmsg";
import { MessageReader as Ros1Reader } from "@foxglove/rosmsg-serialization";
import { MessageReader as Ros2Reader } from "@foxglove/rosmsg2-serialization";
import { MessageType, ULog } from "@foxglove/ulog";
import { FileReader as UlogFile } from "@foxglove/ulog/node.js";

const [, , path, option] = process.argv;
const view = new DataView(new ArrayBuffer(8));
function bits(number) {
  if (Number.isNaN(number)) return "nan";
  view.setFloat64(0, number);
  return view.getBigUint64(0).toString(16).padStart(16, "0");
}
function whole(big) {
  const number = Number(big);
  return Math.abs(number) < 9007199254740992 ? bits(number) : `i${big}`;
}
const isTime = (value) => typeof value === "object" && Object.keys(value).length === 2 && "sec" in value && ("nsec" in value || "nanosec" in value);
const nanoseconds = (time) => BigInt(time.sec) * 1000000000n + BigInt(time.nsec ?? time.nanosec);

function flatten(value, at, lines) {
  if (typeof value === "bigint") lines.push(`${at}=${whole(value)}`);
  else if (typeof value === "number") lines.push(`${at}=${bits(value)}`);
  else if (typeof value === "boolean") lines.push(`${at}=${bits(value ? 1 : 0)}`);
  else if (typeof value === "string") lines.push(`${at}=t${Buffer.from(value, "utf8").toString("hex")}`);
  else if (Array.isArray(value) || ArrayBuffer.isView(value)) for (let i = 0; i < value.length; ++i) flatten(value[i], `${at}[${i}]`, lines);
  else if (isTime(value)) lines.push(`${at}=${whole(nanoseconds(value))}`);
  else for (const [key, member] of Object.entries(value)) flatten(member, at === "" ? key : `${at}.${key}`, lines);
}

function show(topic, time, value) {
  const lines = [];
  if (value !== undefined) flatten(value, "", lines);
  const text = value === undefined ? "not decoded" : lines.map((line) => line + "\n").join("");
  process.stdout.write(`${topic} ${time} ${lines.length} ${createHash("sha256").update(text).digest("hex")}\n`);
  if (option === "--fields") process.stdout.write(text);
}

async function bag() {
  const handlers = await loadDecompressHandlers();
  const decompress = Object.fromEntries(["lz4", "bz2"].map((kind) => [kind, (bytes, size) => handlers[kind](bytes, BigInt(size))]));
  const opened = new Bag(new FileReader(path), { decompress, parse: false });
  await opened.open();
  const readers = new Map();
  for await (const { topic, timestamp, data, connectionId } of opened.messageIterator()) {
    if (!readers.has(connectionId)) readers.set(connectionId, new Ros1Reader(parse(opened.connections.get(connectionId).messageDefinition)));
    show(topic, nanoseconds(timestamp), readers.get(connectionId).readMessage(data));
  }
}

async function mcap() {
  const stream = new McapStreamReader({ decompressHandlers: await loadDecompressHandlers(), validateCrcs: true });
  stream.append(readFileSync(path));
  const schemas = new Map(), channels = new Map();
  for (let record = stream.nextRecord(); record !== undefined; record = stream.nextRecord()) {
    if (record.type === "Schema") schemas.set(record.id, record);
    if (record.type === "Channel" && !channels.has(record.id)) {
      const schema = schemas.get(record.schemaId);
      const text = schema === undefined ? "" : new TextDecoder().decode(schema.data);
      const reader = schema?.encoding === "ros2msg" ? new Ros2Reader(parse(text, { ros2: true }))
                   : schema?.encoding === "ros1msg" ? new Ros1Reader(parse(text)) : undefined;
      channels.set(record.id, { topic: record.topic, reader });
    }
    if (record.type !== "Message") continue;
    const { topic, reader } = channels.get(record.channelId);
    show(topic, record.logTime, reader?.readMessage(record.data));
  }
}

async function ulog() {
  const opened = new ULog(new UlogFile(path));
  await opened.open();
  for await (const message of opened.readMessages()) {
    if (message.type !== MessageType.Data) continue;
    const { name, multiId } = opened.subscriptions.get(message.msgId);
    show(multiId === 0 ? name : `${name}[${multiId}]`, message.value.timestamp * 1000n, message.value);
  }
}

await { bag, mcap, ulg: ulog }[path.split(".").pop()]();
