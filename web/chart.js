// A line chart (uPlot) over time or over the way: series, bands, limits, shaded stretches. Its cursor is shared with every
// other plot, its window of time with every other chart over time.
import { indexBefore } from './column.js';
import { html, isSeen } from './dom.js';
import { fixed, significant } from './format.js';
import { listen } from './gestures.js';
import { colour } from './palette.js';
import { asSvg } from './pens.js';
import { linear, logTicks, logTickText, ticks, tickText } from './scale.js';
import { cursorTime, on, setCursor, setTimeWindow, soon, timeWindow } from './shared.js';
import { text } from './strings/en.js';

const size = 12;
const mostRows = 1800; // of one series in view

function nulls(values, factor) {
  return Array.from(values, (value) => (Number.isNaN(value) ? null : value * factor));
}

// One x for all: where a series has no value of its own at another's x it is skipped.
function table({ series, bands = [] }, factor) {
  const xs = new Set([...bands, ...series].map(({ x }) => x));
  if (xs.size === 1) return [Array.from(series[0].x), ...bands.flatMap(({ low, high }) => [nulls(low, factor), nulls(high, factor)]), ...series.map(({ y }) => nulls(y, factor))];
  const tables = [];
  const add = (x, ...columns) => tables.push([Array.from(x), ...columns.map((column) => nulls(column, factor))]);
  for (const band of bands) add(band.x, band.low, band.high);
  for (const one of series) add(one.x, one.y);
  return window.uPlot.join(tables, tables.map((columns) => columns.map(() => 2)));
}

function wholeOf({ series, bands = [] }) {
  const ends = [...bands, ...series].filter(({ x }) => x.length > 0).flatMap(({ x }) => [x[0], x.at(-1)]);
  const [low, high] = ends.length > 0 ? [Math.min(...ends), Math.max(...ends)] : [0, 1];
  return high > low ? [low, high] : [low - 0.5, low + 0.5];
}

// Of what is in the window no more than a screen can show: of each stretch the smallest and the largest value.
function reducedTo(spec, window) {
  return { series: spec.series.map((one) => reduced(one, window, ['y'])), bands: (spec.bands ?? []).map((one) => reduced(one, window, ['low', 'high'])) };
}

function reduced(one, [low, high], names) {
  const begin = Math.max(0, indexBefore(one.x, low) - 1);
  const end = Math.min(one.x.length, indexBefore(one.x, high) + 2);
  if (end - begin <= mostRows) return begin === 0 && end === one.x.length ? one : { ...one, ...rowsOf(one, ['x', ...names], Array.from({ length: end - begin }, (unused, i) => begin + i)) };
  const kept = [];
  const stretches = mostRows / (2 * names.length);
  for (let i = 0; i < stretches; ++i) {
    const [from, to] = [i, i + 1].map((edge) => begin + Math.floor(((end - begin) * edge) / stretches));
    for (const name of names) kept.push(...extremes(one[name], from, to));
  }
  return { ...one, ...rowsOf(one, ['x', ...names], [...new Set(kept)].sort((a, b) => a - b)) };
}

// Where the smallest and the largest value are, and one that is missing, for the gap.
function extremes(values, from, to) {
  let [least, most, none] = [-1, -1, -1];
  for (let i = from; i < to; ++i) {
    if (Number.isNaN(values[i])) none = i;
    else {
      if (least < 0 || values[i] < values[least]) least = i;
      if (most < 0 || values[i] > values[most]) most = i;
    }
  }
  return [least, most, none].filter((i) => i >= 0);
}

function rowsOf(one, names, rows) {
  return Object.fromEntries(names.map((name) => [name, Float64Array.from(rows, (row) => one[name][row])]));
}

function withAlpha(name, alpha) {
  return `color-mix(in srgb, ${name} ${Math.round(100 * alpha)}%, transparent)`;
}

function rangeOf(spec, factor) {
  return (plot, low, high) => {
    const wanted = [low, high, ...(spec.limits ?? []).filter((limit) => limit.inView).map((limit) => limit.value * factor)].filter(Number.isFinite);
    if (wanted.length === 0) return spec.y.log ? [0.1, 1] : [0, 1];
    const [least, most] = [Math.min(...wanted, spec.y.from ?? Infinity), Math.max(...wanted, spec.y.to ?? -Infinity)];
    if (spec.y.log) return most > 0 ? [Math.max(least * 0.8, 1e-12), most * 1.25] : [0.1, 1]; // all zero: a gyro that is exactly still
    const top = Math.min(most, spec.y.most ?? Infinity);
    const bottom = Math.max(least, spec.y.least ?? -Infinity);
    const margin = 0.06 * (top - bottom || Math.abs(top) || 1);
    return [spec.y.from === bottom ? bottom : bottom - margin, top + margin];
  };
}

function seriesOptions(spec) {
  const options = [{}];
  for (const band of spec.bands ?? []) {
    const edge = { stroke: withAlpha(band.colour, 0.45), width: 0.8, points: { show: false }, spanGaps: false };
    options.push(edge, edge);
  }
  for (const { style, dots } of spec.series) {
    options.push(dots ? { stroke: style.colour, width: 0, paths: () => null, points: { show: true, size: 4, fill: style.colour, width: 0 } }
      : { stroke: style.colour, width: style.width, dash: style.dash.length > 0 ? style.dash : undefined, points: { show: false } });
  }
  return options;
}

// Stretches of x behind the curves, limits and marks before them.
function underlay(spec, factor) {
  return (plot) => {
    const { ctx: pen, bbox } = plot;
    const ratio = devicePixelRatio;
    pen.save();
    pen.beginPath();
    pen.rect(bbox.left, bbox.top, bbox.width, bbox.height);
    pen.clip();
    for (const stretch of spec.stretches ?? []) {
      const from = plot.valToPos(stretch.from, 'x', true);
      const to = Math.max(from + 2 * ratio, plot.valToPos(stretch.to, 'x', true));
      pen.fillStyle = stretch.colour;
      pen.globalAlpha = stretch.alpha ?? 0.16;
      pen.fillRect(from, bbox.top, to - from, bbox.height);
    }
    pen.globalAlpha = 1;
    for (const { value } of spec.limits ?? []) {
      const y = plot.valToPos(value * factor, 'y', true);
      pen.strokeStyle = colour('soft');
      pen.lineWidth = ratio;
      pen.setLineDash([5 * ratio, 4 * ratio]);
      pen.beginPath();
      pen.moveTo(bbox.left, y);
      pen.lineTo(bbox.left + bbox.width, y);
      pen.stroke();
    }
    pen.restore();
  };
}

function tickOf(value, step) {
  return Math.abs(value) >= 1e4 || (value !== 0 && Math.abs(value) < 1e-3) ? significant(value, 2) : tickText(value, step);
}

function axes(spec, unit) {
  const font = `${size}px system-ui, sans-serif`;
  const common = { stroke: colour('soft'), font, labelFont: font, grid: { stroke: colour('grid'), width: 1 }, ticks: { show: false }, labelGap: 0 };
  return [
    { ...common, label: spec.x.name, size: 30, labelSize: 18, space: 70, values: (plot, splits) => splits.map((value) => tickText(value, splits[1] - splits[0] || 1)) },
    { ...common, label: unit.unit ? `${spec.y.name} [${unit.unit}]` : spec.y.name, size: 56, labelSize: 18, space: 34,
      ...(spec.y.log ? { splits: (plot, axis, low, high) => logTicks(low, high), filter: (plot, splits) => splits } : {}),
      values: (plot, splits) => splits.map((value) => (value === null ? '' : spec.y.log ? logTickText(value) : tickOf(value, splits[1] - splits[0]))) },
  ];
}

// The chart in view as an SVG, drawn from the same numbers.
function drawing(plot, spec, factor, unit) {
  const [width, height] = [plot.width, plot.height];
  const inner = { left: 74, right: width - 10, top: 10, bottom: height - 48 };
  const { x: { min: x0, max: x1 }, y: { min: y0, max: y1 } } = plot.scales;
  const x = linear([x0, x1], [inner.left, inner.right]);
  const scaled = spec.y.log ? (value) => Math.log10(Math.max(value, 1e-12)) : (value) => value;
  const upright = linear([scaled(y0), scaled(y1)], [inner.bottom, inner.top]);
  const y = (value) => Math.min(inner.bottom, Math.max(inner.top, upright(scaled(value * factor))));
  const points = (xs, ys) => {
    const flat = [];
    for (let i = 0; i < xs.length; ++i) {
      if (xs[i] < x0 || xs[i] > x1) continue;
      flat.push(Number.isNaN(ys[i]) ? NaN : x(xs[i]), y(ys[i]));
    }
    return flat;
  };
  return asSvg(width, height, (pen) => {
    const soft = { colour: colour('soft'), size };
    const columns = ticks(x0, x1, (inner.right - inner.left) / 90);
    for (const value of columns) {
      pen.line([x(value), inner.top, x(value), inner.bottom], { colour: colour('grid') });
      pen.text(x(value), inner.bottom + 16, tickText(value, columns[1] - columns[0] || 1), { ...soft, align: 'center' });
    }
    const rows = spec.y.log ? logTicks(y0, y1) : ticks(y0, y1, (inner.bottom - inner.top) / 40);
    for (const value of rows) {
      pen.line([inner.left, y(value / factor), inner.right, y(value / factor)], { colour: colour('grid') });
      pen.text(inner.left - 6, y(value / factor) + 4, spec.y.log ? logTickText(value) : tickText(value, rows[1] - rows[0] || 1), { ...soft, align: 'right' });
    }
    for (const { from, to, colour: fill, alpha } of spec.stretches ?? []) {
      const [a, b] = [Math.max(x0, from), Math.min(x1, to)];
      if (a < b) pen.polygon([x(a), inner.top, x(b), inner.top, x(b), inner.bottom, x(a), inner.bottom], { fill, fillOpacity: alpha ?? 0.16 });
    }
    for (const band of spec.bands ?? []) {
      const upper = points(band.x, band.high);
      const lower = points(band.x, band.low);
      for (let i = lower.length - 2; i >= 0; i -= 2) upper.push(lower[i], lower[i + 1]);
      pen.polygon(upper.filter((value, i, all) => !Number.isNaN(all[i - (i % 2)])), { fill: band.colour, fillOpacity: 0.15 });
    }
    for (const { value } of spec.limits ?? []) pen.line([inner.left, y(value), inner.right, y(value)], { colour: colour('soft'), dash: [5, 4] });
    for (const one of spec.series) {
      const flat = points(one.x, one.y);
      if (!one.dots) pen.line(flat, { colour: one.style.colour, width: one.style.width, dash: one.style.dash });
      for (let i = 0; one.dots && i < flat.length; i += 2) if (!Number.isNaN(flat[i])) pen.ellipse(flat[i], flat[i + 1], 2, 2, 0, { fill: one.style.colour });
    }
    pen.text((inner.left + inner.right) / 2, height - 10, spec.x.name, { ...soft, align: 'center' });
    pen.text(14, (inner.top + inner.bottom) / 2, unit.unit ? `${spec.y.name} [${unit.unit}]` : spec.y.name, { ...soft, align: 'center', turn: -Math.PI / 2 });
  }, spec.label);
}

function clamped([low, high], [least, most]) {
  const span = Math.min(high - low, most - least);
  const start = Math.min(Math.max(low, least), most - span);
  return [start, start + span];
}

// What stands under the cursor, in words.
function reading(spec, at, unit) {
  const parts = spec.series.map((one) => {
    const i = indexBefore(one.x, at);
    const value = one.x.length > 0 && at >= one.x[0] ? one.y[i] : NaN;
    return Number.isNaN(value) ? null : `${one.name}: ${significant(value * unit.factor, 3)}${unit.unit ? ` ${unit.unit}` : ''}`;
  }).filter(Boolean);
  return `${spec.x.short} ${fixed(at, 2)}${spec.x.unit ? ` ${spec.x.unit}` : ''}${parts.length > 0 ? ` · ${parts.join(' · ')}` : ''}`;
}

// spec: {label, height, x: {name, short, unit, isTime, ofTime?, toTime?}, y: {name, unit: {factor, unit}, from?, least?, most?, log?},
//   series: [{name, x, y, style, dots?}], bands: [{x, low, high, colour}], limits: [{value, inView}],
//   stretches: [{from, to, colour}]}; returns {node, svg(), zoom(), reset()}.
export function chart(spec) {
  const unit = spec.y.unit;
  const factor = unit.factor;
  const whole = wholeOf(spec);
  const box = html('div', { class: 'chart', tabindex: '0', role: 'img', 'aria-label': `${spec.label}. ${text.plot.keys}` });
  const readout = html('p', { class: 'readout', 'aria-hidden': 'true' }, '\u00a0');
  const node = html('div', {}, box, readout);
  let plot = null;

  let asked = null;
  let pending = false;
  let stale = false; // the window moved while it was out of sight
  const draw = () => {
    pending = false;
    stale = !isSeen(box);
    if (!plot || stale) return;
    plot.setData(tableIn(asked ?? whole), false);
    plot.setScale('x', { min: (asked ?? whole)[0], max: (asked ?? whole)[1] });
  };
  const tableIn = (window) => table(reducedTo(spec, window), factor);
  const show = (window, ours = true) => {
    const next = clamped(window, whole);
    if (spec.x.isTime && ours) setTimeWindow(next[1] - next[0] >= 0.999 * (whole[1] - whole[0]) ? null : next, node);
    asked = next;
    if (!pending) requestAnimationFrame(draw);
    pending = true;
  };
  const inView = () => asked ?? whole;
  const moves = {
    pan: (dx) => {
      const [low, high] = inView();
      show([low + dx * (high - low), high + dx * (high - low)]);
    },
    zoom: (by, at = { x: 0.5 }) => {
      const [low, high] = inView();
      const middle = low + at.x * (high - low);
      const span = Math.max((high - low) / by, 1e-5 * (whole[1] - whole[0]));
      show([middle - at.x * span, middle + (1 - at.x) * span]);
    },
    reset: () => show(whole),
    tap: (at) => {
      const [low, high] = inView();
      spec.onTap?.(low + at.x * (high - low));
    },
  };
  const place = (time, source) => {
    if (!plot || source === node) return;
    const x = time === null ? null : spec.x.isTime ? time : spec.x.ofTime?.(time);
    if (x === null || x === undefined) {
      plot.setCursor({ left: -10, top: -10 }, false);
      return;
    }
    plot.setCursor({ left: plot.valToPos(x, 'x'), top: 0 }, false);
    readout.textContent = reading(spec, x, unit);
  };
  const moved = (own) => {
    const { left } = own.cursor;
    if (!(left >= 0) || !own.over.matches(':hover')) return;
    const x = own.posToVal(left, 'x');
    readout.textContent = reading(spec, x, unit);
    setCursor(spec.x.isTime ? x : spec.x.toTime?.(x) ?? null, node);
  };

  const build = (width) => {
    asked = spec.x.isTime ? timeWindow() ?? whole : whole;
    const fills = (spec.bands ?? []).map((band, i) => ({ series: [2 * i + 2, 2 * i + 1], fill: withAlpha(band.colour, 0.14) }));
    plot = new window.uPlot({
      width, height: spec.height ?? 240, legend: { show: false }, pxAlign: 0, padding: [10, 10, 0, 0],
      cursor: { drag: { setScale: false, x: false, y: false }, points: { size: 7 }, y: false, bind: { dblclick: () => null } },
      scales: { x: { time: false, range: (own, low, high) => [low ?? 0, high ?? 1] }, y: { range: rangeOf(spec, factor), distr: spec.y.log ? 3 : 1 } },
      series: seriesOptions(spec), bands: fills, axes: axes(spec, unit),
      hooks: { drawAxes: [underlay(spec, factor)], setCursor: [moved] },
    }, tableIn(asked), box);
    plot.setScale('x', { min: asked[0], max: asked[1] });
    listen(plot.over, box, moves);
    place(cursorTime(), null);
  };

  let drawn = 0;
  const fit = () => {
    const width = Math.floor(box.clientWidth);
    if (width === 0 || width === drawn) return;
    drawn = width;
    if (plot) plot.setSize({ width, height: plot.height });
    else build(width);
  };
  new ResizeObserver(() => soon(fit)).observe(box);
  new IntersectionObserver(() => stale && draw()).observe(box);
  on('fit', fit);
  on('cursor', place);
  if (spec.x.isTime) on('window', (window, source) => source !== node && show(window ?? whole, false));
  return { node, svg: () => drawing(plot, spec, factor, unit), zoom: moves.zoom, reset: moves.reset };
}

