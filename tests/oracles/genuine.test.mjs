// Every field of every message of the logs below TRUNDLE_DATA (without it, of those below ../shared/data), as Trundle decodes
// it and as others do.
import assert from "node:assert/strict";
import { existsSync, readdirSync } from "node:fs";
import { join } from "node:path";
import { test } from "node:test";
import { all, countFields, difference, ourLines } from "./compare.mjs";
import { theirLines } from "./read.mjs";

/// Files by their endings, and folders of rosbag2.
function logsBelow(folder) {
  if (existsSync(join(folder, "metadata.yaml"))) return [folder];
  return readdirSync(folder, { withFileTypes: true }).flatMap((entry) => {
    const path = join(folder, entry.name);
    if (entry.isDirectory()) return logsBelow(path);
    return /\.(bag|mcap|db3|wpilog|bin|ulg)(\.zstd?)?$/.test(entry.name) ? [path] : [];
  }).sort();
}

const folder = process.env.TRUNDLE_DATA;
const logs = existsSync(folder) ? logsBelow(folder) : [];
if (logs.length === 0) test("genuine logs", { skip: `no logs below ${folder}` }, () => {});
for (const log of logs)
  test(log.slice(folder.length + 1), async (t) => {
    const { lines, said } = await ourLines(log);
    const theirs = await all(theirLines(log));
    assert.equal(difference(lines, theirs), undefined, said);
    t.diagnostic(`${lines.length} messages, ${countFields(lines)} fields`);
  });
