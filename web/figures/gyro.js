// The gyro's bias over time, and its noise by averaging time.
import { chart } from '../chart.js';
import { extent } from '../column.js';
import { html } from '../dom.js';
import { display } from '../format.js';
import { colour } from '../palette.js';
import { section, tooled } from '../section.js';
import { text } from '../strings/en.js';

function median(values) {
  return Float64Array.from(values).sort()[values.length >> 1];
}

// What fits the curve, and its band for half of the time: before the first rest it is many times wider.
function rangeOf(y, { low, high }, factor) {
  const [least, most] = extent(y, [median(low), median(high)]);
  return { least: least * factor, most: most * factor };
}

function curveOf(found, name, style) {
  const { time_s: x, rad_s: y, sigma_rad_s: sigma } = found.columns();
  const band = { x, low: y.map((value, i) => value - 1.96 * sigma[i]), high: y.map((value, i) => value + 1.96 * sigma[i]), colour: style.colour };
  return { series: { name, x, y, style }, band };
}

// By odometry, from rests alone, and by the landmark filter, from sightings too.
function bias(odometry, slam) {
  const curves = [
    odometry && curveOf(odometry, text.gyro.bias, { colour: colour('after'), width: 1.6, dash: [] }),
    slam && curveOf(slam, text.gyro.bySlam, { colour: colour('track-online'), width: 1.6, dash: [7, 4] }),
  ].filter(Boolean);
  const unit = display('rad/s');
  const [{ series: { y }, band }] = curves;
  return chart({ label: text.gyro.title, height: 220, x: { name: text.plot.time, short: text.plot.timeShort, unit: 's', isTime: true }, y: { name: text.gyro.bias, unit, ...rangeOf(y, band, unit.factor) },
    series: curves.map(({ series }) => series), bands: curves.map((curve) => curve.band), stretches: (odometry?.rests ?? []).map(([from, to]) => ({ from, to, colour: colour('good'), alpha: 0.18 })) });
}

function allan(points) {
  const x = Float64Array.from(points, ({ tau_s: tau }) => Math.log10(tau));
  const y = Float64Array.from(points, ({ deviation_rad_s: deviation }) => deviation ?? NaN);
  const style = { colour: colour('after'), width: 1.6, dash: [] };
  return chart({ label: text.gyro.allanTitle, height: 220, x: { name: `log₁₀ ${text.gyro.tau}`, short: 'log₁₀ τ', unit: '', isTime: false }, y: { name: text.gyro.deviation, unit: display('rad/s'), log: true },
    series: [{ name: text.gyro.deviation, x, y, style }, { name: '', x, y, style, dots: true }] });
}

export function gyro([{ gyro: found }]) {
  if (!found) return null;
  const points = found.noise?.allan ?? [];
  return section(text.gyro, found.bias || found.slam_bias ? tooled(bias(found.bias, found.slam_bias), text.gyro.title) : null,
    points.length > 1 ? [html('h4', {}, text.gyro.allanTitle), html('p', { class: 'note' }, text.gyro.allan), tooled(allan(points), text.gyro.allanTitle)] : null);
}
