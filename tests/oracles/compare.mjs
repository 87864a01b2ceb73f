// Lines of Trundle against lines of others.
import { spawn } from "node:child_process";

/// What Trundle decodes of a log, and what it says of it.
export async function ourLines(path) {
  const child = spawn(process.env.TRUNDLE_DUMP_LOG, [path]);
  let said = "";
  child.stderr.on("data", (text) => (said += text));
  const ended = new Promise((resolve) => child.on("close", resolve));
  const pieces = [];
  for await (const piece of child.stdout) pieces.push(piece);
  if ((await ended) !== 0) throw new Error(`dump_log ${path}: ${said}`);
  const lines = Buffer.concat(pieces).toString("utf8").split("\n");
  lines.pop();  // behind the last end of a line
  return { lines, said };
}

export async function all(lines) {
  const found = [];
  for await (const line of lines) found.push(line);
  return found;
}

/// Of two lines that are not the same the first field that is not.
function fieldOf(ours, theirs) {
  if (ours === undefined || theirs === undefined) return `${ours} | ${theirs}`.slice(0, 400);
  const [a, b] = [ours.split(" "), theirs.split(" ")];
  const at = a.findIndex((word, i) => word !== b[i]);
  return at < 0 ? `${a[0]} ${a[1]}: ${a.length} and ${b.length} words, the first ${b[a.length]}`
                : `${a[0]} ${a[1]}: ${a[at]} | ${b[at]}`;
}

/// Nothing where both are the same, else how they differ. As sets of lines: who reads by an index goes by time, Trundle by
/// place.
export function difference(ours, theirs) {
  const [a, b] = [[...ours].sort(), [...theirs].sort()];
  const at = a.findIndex((line, i) => line !== b[i]);
  if (at < 0 && a.length === b.length) return undefined;
  return `${a.length} messages, ${b.length} expected; ours | theirs: ${at < 0 ? b[a.length].slice(0, 400) : fieldOf(a[at], b[at])}`;
}

export const countFields = (lines) => lines.reduce((sum, line) => sum + (line.match(/=/g)?.length ?? 0), 0);
