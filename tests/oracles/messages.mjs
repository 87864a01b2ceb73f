// Messages of every type of field that the languages of ROS have, and what writes them.
import cdr from "@foxglove/cdr";
import omgidl from "@foxglove/omgidl-parser";
import omg from "@foxglove/omgidl-serialization";
import common from "@foxglove/rosmsg-msgs-common";
import ros1 from "@foxglove/rosmsg-serialization";
import ros2 from "@foxglove/rosmsg2-serialization";
import { fieldsOf, isTime, structureOf } from "./lines.mjs";
import { commonDecoder, decoderOf, plainIdl } from "./read.mjs";

const { EncapsulationKind } = cdr;
const rule = "=".repeat(80);

const plain = ["bool", "byte", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "float32",
  "float64", "string"];
const constants = `# Constants are no fields, comments nothing at all.
int32 ANSWER=-42
uint8 LARGE = 255   # with a comment
float64 HALF=0.5
bool YES=True
string GREETING= hello "you" # and this is of the text, too
`;
const inner = (time, span) => `${rule}
MSG: oracle_msgs/Inner
uint8 odd_place
float64 value
string[] names
Deep[] deep
${rule}
MSG: oracle_msgs/Deep
${time} stamp
${span} span
int16[2] pair
${rule}
MSG: oracle_msgs/Empty
# nothing
uint8 BUT_A_CONSTANT=1
`;
const header = (time) => `${rule}
MSG: std_msgs/Header
${time} stamp
string frame_id
`;

const ros1msg = `${constants}Header header
${plain.map((type) => `${type} one_${type}
${type}[] many_${type}
uint8 after_${type}
${type}[3] three_${type}`).join("\n")}
time stamp
time[] stamps
duration span
duration[2] spans
Inner inner
Inner[] inners
oracle_msgs/Inner[2] two_inners
Empty empty
Empty[] empties
Empty[2] two_empties
uint8 last
${inner("time", "duration")}${rule}
MSG: std_msgs/Header
uint32 seq
time stamp
string frame_id
`;

const [ros2Time, ros2Span] = ["builtin_interfaces/Time", "builtin_interfaces/Duration"];
const ros2msg = `${constants}std_msgs/Header header
${plain.map((type) => `${type} one_${type}
${type}[] many_${type}
uint8 after_${type}
${type}[3] three_${type}
${type}[<=4] few_${type}`).join("\n")}
string<=12 short_text
string<=12[<=3] few_short_texts
int32 with_default 42  # fields may have defaults
float64[3] with_defaults [1.5, -2.5, 0.0]
string text_with_default "of this, # and that"
bool flag_with_default true
${ros2Time} stamp
${ros2Time}[] stamps
${ros2Span} span
${ros2Span}[2] spans
Inner inner
Inner[] inners
Inner[<=3] few_inners
oracle_msgs/Inner[2] two_inners
Empty empty
uint16 after_empty
Empty[2] two_empties
uint8 last
${inner(ros2Time, ros2Span)}${header(ros2Time)}${rule}
MSG: ${ros2Time}
int32 sec
uint32 nanosec
${rule}
MSG: ${ros2Span}
int32 sec
uint32 nanosec
`;

const idlPlain = ["boolean", "octet", "char", "int8", "uint8", "int16", "uint16", "int32", "uint32", "int64", "uint64", "short",
  "unsigned short", "long", "unsigned long", "long long", "unsigned long long", "float", "double"];
const named = (type) => type.replaceAll(" ", "_");
const module = (type, text) => {
  const [package_, , name] = type.split("/");
  return `${rule}
IDL: ${type}
#include "somewhere/else.idl"
module ${package_} {
  module msg {
${text.replaceAll("NAME", name)}  };
};
`;
};
const idlTimes = ["Time", "Duration"].map((name) =>
  module(`builtin_interfaces/msg/${name}`, `    struct NAME { int32 sec; uint32 nanosec; };\n`)).join("");
const idlInner = module("oracle_msgs/msg/Inner", `    struct NAME {
      octet odd_place; double value; sequence<string> names; short pair[2]; builtin_interfaces::msg::Time stamp;
    };
`);
const ros2idl = module("oracle_msgs/msg/Everything", `    module NAME_Constants {
      const long ANSWER = -42; const string GREETING = "hello; you"; const boolean YES = TRUE; const double HALF = 0.5;
    };
    enum Colour { RED, GREEN, BLUE };
    typedef double double__9[9];
    typedef sequence<int16, 4> few_shorts;
    typedef string text;
    @verbatim (language="comment", text="a struct { of } all; kinds")
    struct NAME {
      // One, many, few and three of each.
${idlPlain.map((type) => `      ${type} one_${named(type)}; sequence<${type}> many_${named(type)};
      octet after_${named(type)}; ${type} three_${named(type)}[3]; sequence<${type}, 4> few_${named(type)};`).join("\n")}
      string one_string; sequence<string> many_string; string three_string[3]; string<12> short_text;
      sequence<string<12>, 3> few_short_texts; text typed_text; /* a comment
      of two lines */ double__9 covariance; few_shorts shorts; Colour colour; sequence<Colour> colours;
      @unit (value="m") float x, y, z;
      @default (value=7) octet with_default;
      builtin_interfaces::msg::Time stamp; sequence<builtin_interfaces::msg::Duration> spans;
      oracle_msgs::msg::Inner inner; sequence<oracle_msgs::msg::Inner> inners; oracle_msgs::msg::Inner two_inners[2];
      sequence<oracle_msgs::msg::Inner, 3> few_inners; octet last;
    };
`) + idlInner + idlTimes;

/// Of XCDR2, for lack of an oracle, without sequences and arrays of texts or structures, which begin with their size in
/// bytes [DDS-XTypes 1.3, 7.4.3.5.3, rule 12]: @foxglove/omgidl-serialization 1.0.3 does not know of it.
const second = (extensibility) => module("oracle_msgs/msg/Second", `    enum Colour { RED, GREEN, BLUE };
    @${extensibility}
    struct NAME_Inner { octet odd_place; double value; string name; };
    @${extensibility}
    struct NAME {
${idlPlain.map((type) => `      ${type} one_${named(type)}; sequence<${type}> many_${named(type)}; octet after_${named(type)};
      ${type} three_${named(type)}[3];`).join("\n")}
      string one_string; Colour colour; short grid[2][3]; double before; builtin_interfaces::msg::Time stamp;
      oracle_msgs::msg::NAME_Inner inner; octet last;
    };
`) + module("builtin_interfaces/msg/Time", `    @final struct NAME { int32 sec; uint32 nanosec; };\n`);

// ---- values ----

/// A generator of numbers in [0, 1) that begins where its seed says.
function random(seed) {
  let state = seed;
  return () => {
    state = (state + 0x6d2b79f5) | 0;
    let mixed = Math.imul(state ^ (state >>> 15), 1 | state);
    mixed = (mixed + Math.imul(mixed ^ (mixed >>> 7), 61 | mixed)) ^ mixed;
    return ((mixed ^ (mixed >>> 14)) >>> 0) / 2 ** 32;
  };
}

const texts = ["left_wheel_joint", "", "Rädchen µ ☃ 🤖", "a=b c\td\ne", "\0inside\0it", "x".repeat(300), "\"'\\# %s"];
const shortTexts = ["", "map", "zwölf"];
const doubles = [NaN, -0, Infinity, -Infinity, 5e-324, Number.MAX_VALUE, 2 ** 53 + 2, Math.PI, 0.1, 1e-310];
const floats = [NaN, -0, Infinity, -Infinity, 2 ** -149, 3.4028234663852886e38, 16777217, Math.PI, 0.1, 1e-40];

/// What the fields of a message are: at their least, at their greatest, odd, or anything.
export class Values {
  constructor(kind, seed) {
    this.kind = kind;
    this.next = random(seed);
  }
  index = (count) => Math.floor(this.next() * count);

  integer(bits, isSigned) {
    const least = isSigned ? -(1n << BigInt(bits - 1)) : 0n;
    const greatest = (1n << BigInt(isSigned ? bits - 1 : bits)) - 1n;
    if (this.kind === "least") return least;
    if (this.kind === "greatest") return greatest;
    // 53 bits of fraction leave the lowest of 64 at 0.
    const low = BigInt(this.index(2 ** 32)), high = BigInt(this.index(2 ** 32));
    return least + (((high << 32n) | low) & ((1n << BigInt(bits)) - 1n));
  }

  time(isSpan, isElement) {
    const nsec = this.kind === "least" ? 0 : this.kind === "greatest" ? 999999999 : this.index(1e9);
    if (isSpan) return { sec: this.kind === "least" ? -(2 ** 31) : this.index(2 ** 32) - 2 ** 31, nsec };
    // @foxglove/rosmsg-serialization takes the seconds of arrays of times for signed.
    const most = isElement || this.isRos2 ? 2 ** 31 - 1 : 2 ** 32 - 1;
    return { sec: this.kind === "least" ? 0 : this.kind === "greatest" ? most : this.index(most), nsec };
  }

  one(field, isElement) {
    const [, sign, bits] = /^(u?)int(\d+)$/.exec(field.type) ?? [];
    if (bits) {
      const number = this.integer(Number(bits), sign === "");
      return bits === "64" ? number : Number(number);
    }
    switch (field.type) {
      case "bool":
        return this.kind === "least" ? false : this.kind === "greatest" || this.next() < 0.5;
      case "float32":
        return Math.fround(this.kind === "odd" ? floats[this.index(floats.length)] : (this.next() - 0.5) * 1e6);
      case "float64":
        return this.kind === "odd" ? doubles[this.index(doubles.length)] : (this.next() - 0.5) * 1e6;
      case "string":
        return this.kind === "least" ? "" : this.text(field.upperBound ? shortTexts : texts);
      case "time":
      case "duration":
        return this.time(field.type === "duration", isElement);
      default:
        throw new Error(`no value of ${field.type}`);
    }
  }

  text = (from) => from[this.index(from.length)];

  many(field, make) {
    const fixed = field.arrayLengths ?? (field.arrayLength === undefined ? undefined : [field.arrayLength]);
    const most = field.arrayUpperBound ?? 4;
    const count = this.kind === "least" ? 0 : this.kind === "greatest" ? most : this.index(most + 1);
    const of = ([first, ...more]) => Array.from({ length: first }, () => (more.length > 0 ? of(more) : make()));
    return of(fixed ?? [count]);
  }

  message(definitions, definition) {
    const message = {};
    for (const field of fieldsOf(definition)) {
      const structure = field.isComplex ? structureOf(definitions, field.type) : undefined;
      const isStamp = structure && isTime(structure);
      const make = () => isStamp ? this.time(field.type.endsWith("Duration"), true)
        : structure ? this.message(definitions, structure) : this.one(field, field.isArray);
      message[field.name] = field.isArray ? this.many(field, make) : make();
    }
    return message;
  }
}

// ---- writers ----

/// CDR of any kind, by @foxglove/cdr: the serializers of Foxglove write no big-endian one, no XCDR2, and of texts as many
/// bytes as they have letters.
export class CdrMessage {
  constructor({ definitions, root }, kind) {
    Object.assign(this, { definitions, root, kind });
    this.isDelimited = [EncapsulationKind.DELIMITED_CDR2_BE, EncapsulationKind.DELIMITED_CDR2_LE,
      EncapsulationKind.RTPS_DELIMITED_CDR2_BE, EncapsulationKind.RTPS_DELIMITED_CDR2_LE].includes(kind);
  }

  write(message) {
    const writer = new cdr.CdrWriter({ kind: this.kind });
    const sizes = [];  // places of those that are known when what they are of is written
    this.structure(writer, this.root, message, sizes);
    const bytes = Uint8Array.from(writer.data);
    const view = new DataView(bytes.buffer);
    for (const [place, size] of sizes) view.setUint32(place, size, (bytes[1] & 1) === 1);
    return bytes;
  }

  structure(writer, definition, message, sizes) {
    const isAppendable = this.isDelimited && definition.annotations?.appendable !== undefined;
    let start;
    if (isAppendable) start = writer.dHeader(0).size;
    const fields = fieldsOf(definition);
    if (fields.length === 0) writer.uint8(0);  // ROS 2 has no empty structures
    for (const field of fields) {
      let value = message[field.name];
      if (field.isArray && !field.arrayLengths && field.arrayLength === undefined) writer.sequenceLength(value.length);
      if (field.isArray) value = value.flat(Infinity);
      for (const one of field.isArray ? value : [value]) this.element(writer, field, one, sizes);
    }
    if (isAppendable) sizes.push([start - 4, writer.size - start]);
  }

  element(writer, field, value, sizes) {
    if (field.type === "time" || field.type === "duration") return this.time(writer, value);
    if (field.isComplex) {
      const inner = structureOf(this.definitions, field.type);
      return isTime(inner) ? this.time(writer, value) : this.structure(writer, inner, value, sizes);
    }
    if (field.type === "bool") return writer.uint8(value ? 1 : 0);
    if (field.type !== "string") return writer[field.type](value);
    const text = Buffer.from(value, "utf8");
    writer.uint32(text.length + 1).uint8Array(text).uint8(0);
  }

  time(writer, { sec, nsec }) {
    writer.int32(sec).uint32(nsec);
  }
}

/// As an object that takes a time's nanoseconds by the name that ROS 2 has for them.
function withNanoseconds(value) {
  if (Array.isArray(value)) return value.map(withNanoseconds);
  if (typeof value !== "object") return value;
  if (value.nsec !== undefined) return { sec: value.sec, nanosec: value.nsec };
  return Object.fromEntries(Object.entries(value).map(([name, inner]) => [name, withNanoseconds(inner)]));
}

const isPlain = (text) => Array.from(text).every((letter) => letter.codePointAt(0) < 128);

function allTexts(value, out = []) {
  if (typeof value === "string") out.push(value);
  else if (typeof value === "object") Object.values(value).forEach((inner) => allTexts(inner, out));
  return out;
}

/// By the serializer of the language, where its texts are ASCII.
function byLibrary(writer, other) {
  return (message) => allTexts(message).every(isPlain) ? writer.writeMessage(withNanoseconds(message)) : other.write(message);
}

function channel(topic, encoding, language, type, text, kind) {
  const isSecond = kind > EncapsulationKind.PL_CDR_LE;
  const decoder = decoderOf(language, type, text, isSecond);
  const make = (write) => ({ topic, encoding, language, type, text, decoder, write });
  if (language === "ros1msg") {
    const writer = new ros1.MessageWriter(decoder.definitions);
    return make((message) => writer.writeMessage(message));
  }
  const own = new CdrMessage(decoder, kind);
  if (kind !== EncapsulationKind.CDR_LE) return make((message) => own.write(message));
  const library = language === "ros2msg" ? new ros2.MessageWriter(decoder.definitions)
    : new omg.MessageWriter(type.replaceAll("/", "::"), omgidl.parseIDL(plainIdl(text)));
  return make(byLibrary(library, own));
}

const kindsOfSecond = { final: ["CDR2_LE", "CDR2_BE", "RTPS_CDR2_LE", "RTPS_CDR2_BE"],
  appendable: ["DELIMITED_CDR2_LE", "DELIMITED_CDR2_BE", "RTPS_DELIMITED_CDR2_LE", "RTPS_DELIMITED_CDR2_BE"] };

/// One of each language and kind of encoding.
export const ros1Channel = channel("/ros1", "ros1", "ros1msg", "oracle_msgs/Everything", ros1msg);
export const ros2Channels = ["LE", "BE"].flatMap((order) => [
  channel(`/ros2msg/${order}`, "cdr", "ros2msg", "oracle_msgs/msg/Everything", ros2msg, EncapsulationKind[`CDR_${order}`]),
  channel(`/ros2idl/${order}`, "cdr", "ros2idl", "oracle_msgs/msg/Everything", ros2idl, EncapsulationKind[`CDR_${order}`])]);
export const secondChannels = Object.entries(kindsOfSecond).flatMap(([extensibility, kinds]) => kinds.map((kind) =>
  channel(`/ros2idl/${kind}`, "cdr", "ros2idl", "oracle_msgs/msg/Second", second(extensibility), EncapsulationKind[kind])));

/// Of each type that ROS 2 Humble brings along, in either order of bytes. Of constants alone @foxglove/rosmsg2-serialization
/// makes no message.
const isMessage = ([, { definitions }]) => definitions.length === 0 || definitions.some((field) => !field.isConstant);
const commonTypes = Object.entries(common.ros2humble).filter(isMessage).map(([type]) => type);
export const commonChannels = commonTypes.flatMap((type) => ["LE", "BE"].map((order) => {
  const decoder = commonDecoder(type);
  const own = new CdrMessage(decoder, EncapsulationKind[`CDR_${order}`]);
  return { topic: `/${type}/${order}`, encoding: "cdr", type: type.includes("/msg/") ? type : type.replace("/", "/msg/"),
    decoder, write: (message) => own.write(message) };
}));

/// Messages of some channels in the order of time: those at the limits first, then others.
export function messagesOf(channels, count = 8) {
  const kinds = ["least", "greatest", "odd", "odd"];
  const messages = [];
  for (let i = 0; i < count; ++i)
    channels.forEach((one, number) => {
      const values = new Values(kinds[i] ?? "any", 1000 * i + number);
      values.isRos2 = one.language !== "ros1msg";
      const message = values.message(one.decoder.definitions, one.decoder.root);
      const time = 1700000000000000000n + BigInt(i) * 100000001n + BigInt(number);
      messages.push({ channel: one, time, message, bytes: one.write(message) });
    });
  return messages;
}
