// A message as dump_log.cpp prints it, from an object as Foxglove's libraries give and take it: "topic time_ns", then
// " path=value" for each field in the order of the definition.

const bits = new DataView(new ArrayBuffer(8));

function textOf(value, type) {
  // @foxglove/ulog leaves the zeros that fill a text of ULog up.
  if (type === "char") value = value.split("\0")[0];
  if (typeof value === "string") return "s" + Buffer.from(value, "utf8").toString("hex");
  if (typeof value === "boolean") return value ? "1" : "0";
  if (!/^(float|double)/.test(type)) return value.toString();
  if (Number.isNaN(value)) return "nan";
  bits.setFloat64(0, value);
  return "d" + bits.getBigUint64(0).toString(16).padStart(16, "0");
}

export const nanoseconds = (time) => BigInt(time.sec) * 1000000000n + BigInt(time.nsec ?? time.nanosec);

/// The fields of a structure that are in a message.
export const fieldsOf = (definition) => definition.definitions.filter((field) => !field.isConstant);

/// The structure that a field is of.
export function structureOf(definitions, type) {
  const found = definitions.find((other) => other.name === type) ??
    definitions.find((other) => other.name?.endsWith("/" + type));
  if (!found) throw new Error(`no definition of ${type}`);
  return found;
}

/// ROS 2 has a time as a structure of two fields; it is one value.
export function isTime(definition) {
  const [first, second, ...more] = fieldsOf(definition);
  return first?.name === "sec" && first.type === "int32" && /^nano?sec$|^nsec$/.test(second?.name) && more.length === 0;
}

function* elementsOf(value) {
  for (const element of value) {
    if (Array.isArray(element) || ArrayBuffer.isView(element)) yield* elementsOf(element);
    else yield element;
  }
}

function append(definitions, definition, message, before, out) {
  for (const field of fieldsOf(definition)) {
    const structure = field.isComplex ? structureOf(definitions, field.type) : undefined;
    const isStamp = field.type === "time" || field.type === "duration" || (structure && isTime(structure));
    const element = (value, at) => {
      if (isStamp) out.push(`${at}=${nanoseconds(value)}`);
      else if (structure) append(definitions, structure, value, at + ".", out);
      else out.push(`${at}=${textOf(value, field.type)}`);
    };
    const path = before + field.name, value = message[field.name];
    if (field.isArray) [...elementsOf(value)].forEach((one, i) => element(one, `${path}[${i}]`));
    else element(value, path);
  }
}

export function lineOf(topic, time, { definitions, root }, message) {
  const out = [`${topic} ${time}`];
  append(definitions, root, message, "", out);
  return out.join(" ");
}

/// Of a message that nobody decodes.
export const lineOfBytes = (topic, time, bytes) => `${topic} ${time} bytes=${Buffer.from(bytes).toString("hex")}`;
