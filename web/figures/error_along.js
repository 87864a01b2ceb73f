// Position and heading error over the way driven, with what the covariance expects.
import { chart } from '../chart.js';
import { indexBefore } from '../column.js';
import { display, lengthUnit } from '../format.js';
import { trackStyle } from '../palette.js';
import { lineLegend, section, tooled } from '../section.js';
import { setting } from '../settings.js';
import { text } from '../strings/en.js';
import { nameOfTrack } from './from_above.js';

export function wayAxis(curves) {
  const unit = lengthUnit([10]);
  const { columns: { time_s: time }, x } = curves[0];
  return { name: text.plot.way(unit.unit), short: text.plot.wayShort, unit: unit.unit, isTime: false,
    ofTime: (at) => (at < time[0] || at > time.at(-1) ? null : x[indexBefore(time, at)]), toTime: (at) => time[indexBefore(x, at)] };
}

export function curvesOf(results) {
  const several = results.length > 1;
  const { factor } = lengthUnit([10]);
  return results.flatMap((result, index) => result.errors.map((error) => {
    const columns = error.columns();
    return { error, name: nameOfTrack(error, result, several), style: trackStyle(error.role, index, several), columns, x: columns.way_m.map((way) => way * factor) };
  }));
}

function largest(curves, name) {
  return curves.reduce((most, { columns }) => columns[name].reduce((high, value) => (Math.abs(value) > high ? Math.abs(value) : high), most), 0);
}

function positions(curves) {
  const series = curves.map(({ name, style, columns, x }) => ({ name, x, y: columns.position_m, style }));
  const highest = largest(curves, 'position_m');
  const bands = curves.filter(({ columns, error }) => columns.bound95_m && error.role !== 'nominal')
    .map(({ columns, style, x }) => ({ x, low: new Float64Array(x.length), high: columns.bound95_m, colour: style.colour }));
  return chart({ label: text.errorAlong.title, height: 260, x: wayAxis(curves), y: { name: text.errorAlong.position, unit: lengthUnit([highest]), from: 0, most: 2.5 * highest * lengthUnit([highest]).factor }, series, bands });
}

function headings(curves) {
  const series = curves.map(({ name, style, columns, x }) => ({ name, x, y: columns.heading_rad, style }));
  const bands = curves.filter(({ columns, error }) => columns.heading95_rad && error.role !== 'nominal')
    .map(({ columns, style, x }) => ({ x, low: columns.heading95_rad.map((value) => -value), high: columns.heading95_rad, colour: style.colour }));
  return chart({ label: text.errorAlong.headingTitle, height: 200, x: wayAxis(curves), y: { name: text.errorAlong.heading, unit: setting('angles') === 'degrees' ? display('rad') : { factor: 1, unit: 'rad' } }, series, bands });
}

export function errorAlong(results) {
  const curves = curvesOf(results);
  if (curves.length === 0) return null;
  const hasHeading = curves.some(({ columns }) => columns.heading_rad.some((value) => !Number.isNaN(value)));
  return section(text.errorAlong, tooled(positions(curves), text.errorAlong.title), hasHeading ? tooled(headings(curves), text.errorAlong.headingTitle) : null,
    lineLegend(curves.map(({ style, name }) => [style, name])));
}
