// node dump_ulog.mjs FILE: what dump_log.cpp prints of a ULog, by @foxglove/ulog.
import { MessageType, ULog } from "@foxglove/ulog";
import { FileReader } from "@foxglove/ulog/node.js";

const bits = new DataView(new ArrayBuffer(8));
function textOf(value, type) {
  if (typeof value === "string") return "s" + Buffer.from(value, "utf8").toString("hex");
  if (typeof value === "boolean") return value ? "1" : "0";
  if (type !== "float" && type !== "double") return value.toString();
  if (Number.isNaN(value)) return "nan";
  bits.setFloat64(0, value);
  return "d" + bits.getBigUint64(0).toString(16).padStart(16, "0");
}

const ulog = new ULog(new FileReader(process.argv[2]));
await ulog.open();

/// Appends " path=value" for each field of a message; padding is none.
function append(fields, message, before, out) {
  for (const field of fields) {
    if (field.name.startsWith("_padding")) continue;
    const element = (value, at) => {
      if (field.isComplex) append(ulog.header.definitions.get(field.type).fields, value, at + ".", out);
      else out.push(`${at}=${textOf(value, field.type)}`);
    };
    const value = message[field.name], path = before + field.name;
    if (field.arrayLength === undefined || typeof value === "string") element(value, path);
    else for (let i = 0; i < value.length; ++i) element(value[i], `${path}[${i}]`);
  }
}

for await (const message of ulog.readMessages()) {
  if (message.type !== MessageType.Data) continue;
  const { name, multiId, fields } = ulog.subscriptions.get(message.msgId);
  const out = [`${multiId === 0 ? name : `${name}[${multiId}]`} ${message.value.timestamp * 1000n}`];
  append(fields, message.value, "", out);
  process.stdout.write(out.join(" ") + "\n");
}
