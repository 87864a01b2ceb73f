// A result of the document with its columns decoded once, stamps on the page's clock.
import { decoded } from './column.js';

const stamps = ['time_s', 'end_s'];
const isColumn = (value) => typeof value?.float32 === 'string';

function columns(table, origin) {
  const values = {};
  for (const [name, value] of Object.entries(table)) {
    if (value === null) values[name] = null;
    if (isColumn(value)) values[name] = decoded(value, stamps.includes(name) ? origin : 0);
  }
  return values;
}

// Decoded when it is first asked for: what is not drawn costs nothing.
function lazily(table, origin) {
  let done = null;
  return () => (done ??= columns(table, origin));
}

const snapshotOf = (origin) => (one) => ({ ...one, time_s: one.time_s - origin, path: columns(one.path, 0), landmarks: columns(one.landmarks, 0) });

export function prepared(result) {
  const origin = result.origin_s;
  const withColumns = (table) => table && { ...table, columns: lazily(table, origin) };
  const track = (one) => ({ ...withColumns(one), marks: one.marks.map((mark) => ({ ...mark, time_s: mark.time_s - origin })) });
  const since = (event) => ({ ...event, start_s: event.start_s - origin, end_s: event.end_s - origin });
  const { slip, gyro, growth } = result;
  return {
    ...result,
    tracks: result.tracks.map(track),
    errors: result.errors.map((error) => withColumns(error)),
    slip: slip && { ...slip, events: slip.events.map(since), timeline: withColumns(slip.timeline) },
    gyro: gyro && { ...gyro, slam_bias: withColumns(gyro.slam_bias), bias: gyro.bias && { ...withColumns(gyro.bias), rests: gyro.bias.rests.map((rest) => rest.map((time) => time - origin)) } },
    growth: growth.map(({ robot, snapshots, moved }) => ({ robot, snapshots: snapshots.map(snapshotOf(origin)), moved: withColumns(moved) })),
    particles: withColumns(result.particles),
    filter: withColumns(result.filter),
    sightings: withColumns(result.sightings),
  };
}
