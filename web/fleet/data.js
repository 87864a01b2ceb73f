// The fleet as the page holds it. Rows of the table are numbers of robots: nothing is copied when it is sorted or filtered.
export const fleet = JSON.parse(document.getElementById('data').textContent);

// What each robot's runs gave is parsed when the first robot is opened.
let parsed = null;
export function historyOf(robot) {
  parsed ??= JSON.parse(document.getElementById('history').textContent);
  return parsed[robot];
}

export const robots = fleet.robots;
export const size = robots.name.length;
const lower = robots.name.map((name) => name.toLowerCase());

// [value, low, high, z, outlying] of a robot's parameter by its place among those of its type; null where it is not known.
export function estimateOf(robot, parameter) {
  return robots.values[robot][parameter] ?? null;
}

export function filtered({ words, type, reason }) {
  const parts = words.toLowerCase().split(/\s+/).filter(Boolean);
  const kept = [];
  for (let robot = 0; robot < size; robot += 1) {
    if (type !== null && robots.type[robot] !== type) continue;
    if (reason === 'any' && robots.reasons[robot].length === 0) continue;
    if (reason && reason !== 'any' && !robots.reasons[robot].includes(reason)) continue;
    if (parts.every((part) => lower[robot].includes(part))) kept.push(robot);
  }
  return kept;
}

// By numbers or words; what is not known comes last, in either direction.
export function sorted(rows, key, descending) {
  const values = rows.map(key);
  const places = rows.map((_, i) => i);
  const sign = descending ? -1 : 1;
  const known = (value) => value !== null && value !== undefined && value !== '';
  places.sort((a, b) => {
    const [x, y] = [values[a], values[b]];
    if (!known(x) || !known(y)) return known(y) - known(x) || rows[a] - rows[b];
    return sign * (x < y ? -1 : x > y ? 1 : 0) || rows[a] - rows[b];
  });
  return places.map((place) => rows[place]);
}
