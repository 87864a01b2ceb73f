// A result of the document with its columns decoded once, stamps on the page's clock.
import { decoded } from './column.js';

function columns(table, origin, names) {
  const values = {};
  for (const name of names) values[name] = table[name] ? decoded(table[name], name === 'time_s' || name === 'end_s' ? origin : 0) : null;
  return values;
}

// Decoded when it is first asked for: what is not drawn costs nothing.
function lazily(table, origin, names) {
  let done = null;
  return () => (done ??= columns(table, origin, names));
}

export function prepared(result) {
  const origin = result.origin_s;
  const withColumns = (table, names) => table && { ...table, columns: lazily(table, origin, names) };
  const track = (one) => ({ ...withColumns(one, ['time_s', 'x_m', 'y_m', 'heading_rad', 'across95_m']), marks: one.marks.map((mark) => ({ ...mark, time_s: mark.time_s - origin })) });
  const since = (event) => ({ ...event, start_s: event.start_s - origin, end_s: event.end_s - origin });
  const { slip, gyro } = result;
  return {
    ...result,
    tracks: result.tracks.map(track),
    errors: result.errors.map((error) => withColumns(error, ['time_s', 'way_m', 'position_m', 'bound95_m', 'heading_rad', 'heading95_rad', 'nees'])),
    slip: slip && { ...slip, events: slip.events.map(since), timeline: withColumns(slip.timeline, ['end_s', 'value', 'slipping']) },
    gyro: gyro && { ...gyro, slam_bias: withColumns(gyro.slam_bias, ['time_s', 'rad_s', 'sigma_rad_s']), bias: gyro.bias && { ...withColumns(gyro.bias, ['time_s', 'rad_s', 'sigma_rad_s']), rests: gyro.bias.rests.map((rest) => rest.map((time) => time - origin)) } },
    particles: withColumns(result.particles, ['x_m', 'y_m', 'weight']),
    filter: withColumns(result.filter, ['time_s', 'effective_particles', 'greatest_weight', 'resampled']),
    sightings: withColumns(result.sightings, ['time_s', 'landmark', 'decision', 'nis']),
  };
}
