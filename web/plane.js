// A piece of the ground seen from above: x to the right, y up, the same scale on both.
import { svg } from './dom.js';
import { lengthUnit } from './format.js';
import { linear, ticks, tickText } from './scale.js';

const margin = { left: 46, right: 12, top: 12, bottom: 40 };

// The bounds of points {x, y} with some air around them, at least `least` metres wide.
export function boundsOf(points, least = 1e-3) {
  const range = (values) => {
    const low = Math.min(...values);
    const high = Math.max(...values);
    const half = Math.max((high - low) / 2, least / 2) * 1.08;
    return [(low + high) / 2 - half, (low + high) / 2 + half];
  };
  if (points.length === 0) return { x: [-least, least], y: [-least, least] };
  let bounds = { x: [Infinity, -Infinity], y: [Infinity, -Infinity] };
  for (const { x, y } of points) {
    bounds = { x: [Math.min(bounds.x[0], x), Math.max(bounds.x[1], x)], y: [Math.min(bounds.y[0], y), Math.max(bounds.y[1], y)] };
  }
  return { x: range(bounds.x), y: range(bounds.y) };
}

export function squareAround(bounds) {
  const half = Math.max(bounds.x[1] - bounds.x[0], bounds.y[1] - bounds.y[0]) / 2;
  const middle = ([low, high]) => (low + high) / 2;
  return { x: [middle(bounds.x) - half, middle(bounds.x) + half], y: [middle(bounds.y) - half, middle(bounds.y) + half] };
}

function grid(frame, unit) {
  const { left, right, top, bottom } = frame.inner;
  const lines = [];
  const add = (along, values, step) => {
    for (const value of values) {
      const text = tickText(value, step);
      if (along === 'x') {
        const place = frame.x(value / unit.factor);
        lines.push(svg('path', { class: 'grid', d: `M${place} ${top}V${bottom}` }),
          svg('text', { class: 'tick', x: place, y: bottom + 16, 'text-anchor': 'middle' }, text));
      } else {
        const place = frame.y(value / unit.factor);
        lines.push(svg('path', { class: 'grid', d: `M${left} ${place}H${right}` }),
          svg('text', { class: 'tick', x: left - 6, y: place + 4, 'text-anchor': 'end' }, text));
      }
    }
  };
  const scaled = ([low, high]) => [low * unit.factor, high * unit.factor];
  const horizontal = ticks(...scaled(frame.bounds.x), (right - left) / 70);
  const vertical = ticks(...scaled(frame.bounds.y), (bottom - top) / 50);
  const step = (values) => (values.length > 1 ? values[1] - values[0] : 1);
  add('x', horizontal, step(horizontal));
  add('y', vertical, step(vertical));
  return lines;
}

function axisNames(frame, unit, names) {
  const { left, right, top, bottom } = frame.inner;
  const middle = (top + bottom) / 2;
  return [
    svg('text', { class: 'axis', x: (left + right) / 2, y: bottom + 34, 'text-anchor': 'middle' }, `${names.x} [${unit.unit}]`),
    svg('text', { class: 'axis', x: 11, y: middle, 'text-anchor': 'middle', transform: `rotate(-90 11 ${middle})` }, `${names.y} [${unit.unit}]`),
  ];
}

// Widens the bounds so that they fill width × height at equal scales.
function filling(bounds, width, height) {
  const span = ([low, high]) => high - low;
  const scale = Math.min(width / span(bounds.x), height / span(bounds.y));
  const widened = ([low, high], pixels) => [(low + high) / 2 - pixels / scale / 2, (low + high) / 2 + pixels / scale / 2];
  return { x: widened(bounds.x, width), y: widened(bounds.y, height) };
}

// {root, marks, x(), y(), scale}: put drawings into marks, in pixels.
export function plane({ width, height, bounds, label, names = { x: 'x', y: 'y' } }) {
  const inner = { left: margin.left, right: width - margin.right, top: margin.top, bottom: height - margin.bottom };
  const filled = filling(bounds, inner.right - inner.left, inner.bottom - inner.top);
  const unit = lengthUnit([...filled.x, ...filled.y]);
  const frame = { inner, bounds: filled, x: linear(filled.x, [inner.left, inner.right]), y: linear(filled.y, [inner.bottom, inner.top]) };
  const clip = svg('svg', { x: inner.left, y: inner.top, width: inner.right - inner.left, height: inner.bottom - inner.top,
    viewBox: `${inner.left} ${inner.top} ${inner.right - inner.left} ${inner.bottom - inner.top}` });
  const root = svg('svg', { class: 'plot', width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': label },
    grid(frame, unit), axisNames(frame, unit, names), clip);
  return { root, marks: clip, x: frame.x, y: frame.y, scale: frame.x(1) - frame.x(0), inner };
}

// An SVG path through columns of x and y; null breaks the line.
export function lineThrough({ x_m: xs, y_m: ys }, x, y) {
  let path = '';
  let pen = 'M';
  xs.forEach((value, i) => {
    if (value === null || ys[i] === null) {
      pen = 'M';
      return;
    }
    path += `${pen}${x(value).toFixed(1)} ${y(ys[i]).toFixed(1)}`;
    pen = 'L';
  });
  return path;
}
