// The ground from above on a canvas: tracks with their 95 % tubes, time marks, ellipses, landmarks, slips. A second canvas
// above it holds what moves with the cursor. The same painting, with the other pen, is the exported SVG.
import { extent, indexBefore } from './column.js';
import { html, isSeen } from './dom.js';
import { fixed, lengthUnit, significant } from './format.js';
import { listen } from './gestures.js';
import { colour } from './palette.js';
import { asSvg, canvasPen } from './pens.js';
import { ticks, tickText } from './scale.js';
import { lineSample } from './section.js';
import { cursorTime, on, setCursor, soon, timeWindow } from './shared.js';
import { text } from './strings/en.js';

const margin = { left: 54, right: 10, top: 10, bottom: 44 };
const mostNames = 60; // of landmarks: more would cover the picture
const mostAtOnce = 20000; // poses of all tracks that are drawn in full in every frame
const roughPoints = 4000; // of a track
const mostDashed = 12000; // numbers in a line
const nearest = 24; // pixels: the cursor takes the track it is near to

function boundsOf(spec) {
  const x = extent(...spec.tracks.map((track) => track.x), spec.landmarks.map((landmark) => landmark.x)) ?? [-1, 1];
  const y = extent(...spec.tracks.map((track) => track.y), spec.landmarks.map((landmark) => landmark.y)) ?? [-1, 1];
  return { x, y };
}

// Metres to pixels at one scale for both axes, y up.
export function viewOf(bounds, width, height) {
  const inner = { left: margin.left, right: width - margin.right, top: margin.top, bottom: height - margin.bottom };
  const span = (range) => Math.max(range[1] - range[0], 0.05) * 1.1;
  const scale = Math.min((inner.right - inner.left) / span(bounds.x), (inner.bottom - inner.top) / span(bounds.y));
  return { inner, scale, centre: { x: (bounds.x[0] + bounds.x[1]) / 2, y: (bounds.y[0] + bounds.y[1]) / 2 } };
}

export function projection({ inner, scale, centre }) {
  const [middleX, middleY] = [(inner.left + inner.right) / 2, (inner.top + inner.bottom) / 2];
  return { x: (metres) => middleX + (metres - centre.x) * scale, y: (metres) => middleY - (metres - centre.y) * scale,
    toX: (pixels) => centre.x + (pixels - middleX) / scale, toY: (pixels) => centre.y - (pixels - middleY) / scale };
}

// Points of a track that make a difference of so many pixels, with a pen lifted far outside the picture.
export function line(track, to, inner, { from = 0, end = track.x.length, finest = 1.2, stride = 1 } = {}) {
  const flat = [];
  const [x0, y0, scale] = [to.x(0), to.y(0), to.x(1) - to.x(0)];
  let [lastX, lastY, wasOut] = [NaN, NaN, false];
  for (let i = from; i < end; i += stride) {
    const x = x0 + scale * track.x[i];
    const y = y0 - scale * track.y[i];
    if (Math.abs(x - lastX) + Math.abs(y - lastY) < finest && i + 1 < end) continue;
    const out = x < inner.left - 50 || x > inner.right + 50 || y < inner.top - 50 || y > inner.bottom + 50;
    if (out && wasOut) flat.push(NaN, NaN);
    flat.push(x, y);
    [lastX, lastY, wasOut] = [x, y, out];
  }
  return flat;
}

// Quadrilaterals across the track as wide as 95 % of its positions.
function tube(track, to, inner) {
  const left = [];
  const right = [];
  let [lastX, lastY] = [NaN, NaN];
  for (let i = 0; i < track.x.length; ++i) {
    const x = to.x(track.x[i]);
    const y = to.y(track.y[i]);
    if (Math.abs(x - lastX) + Math.abs(y - lastY) < 4 && i + 1 < track.x.length) continue;
    const half = track.across[i] * Math.abs(to.x(1) - to.x(0));
    const [sin, cos] = [Math.sin(track.heading[i]), Math.cos(track.heading[i])];
    left.push(x - half * sin, y - half * cos);
    right.push(x + half * sin, y + half * cos);
    [lastX, lastY] = [x, y];
  }
  return { left, right, seen: left.length > 2 && inner };
}

function paintTube(pen, track, to, inner) {
  if (!track.across) return;
  const { left, right } = tube(track, to, inner);
  for (let start = 0; start + 2 < left.length; start += 120) {
    const end = Math.min(left.length, start + 122);
    const ring = left.slice(start, end);
    for (let i = end - 2; i >= start; i -= 2) ring.push(right[i], right[i + 1]);
    pen.polygon(ring, { fill: track.style.colour, fillOpacity: 0.13 });
  }
}

export function paintGrid(pen, to, inner, unit) {
  const soft = { colour: colour('soft'), size: 12 };
  const grid = { colour: colour('grid') };
  const stepOf = (values) => (values.length > 1 ? values[1] - values[0] : 1);
  const columns = ticks(to.toX(inner.left) * unit.factor, to.toX(inner.right) * unit.factor, (inner.right - inner.left) / 80);
  const rows = ticks(to.toY(inner.bottom) * unit.factor, to.toY(inner.top) * unit.factor, (inner.bottom - inner.top) / 55);
  for (const value of columns) {
    const x = to.x(value / unit.factor);
    pen.line([x, inner.top, x, inner.bottom], grid);
    pen.text(x, inner.bottom + 16, tickText(value, stepOf(columns)), { ...soft, align: 'center' });
  }
  for (const value of rows) {
    const y = to.y(value / unit.factor);
    pen.line([inner.left, y, inner.right, y], grid);
    pen.text(inner.left - 6, y + 4, tickText(value, stepOf(rows)), { ...soft, align: 'right' });
  }
  pen.text((inner.left + inner.right) / 2, inner.bottom + 36, `x [${unit.unit}]`, { ...soft, align: 'center' });
  pen.text(12, (inner.top + inner.bottom) / 2, `y [${unit.unit}]`, { ...soft, align: 'center', turn: -Math.PI / 2 });
}

export function paintEllipse(pen, to, scale, x, y, ellipse, given) {
  if (ellipse) pen.ellipse(to.x(x), to.y(y), Math.max(0.5, ellipse.semi_major_m * scale), Math.max(0.5, ellipse.semi_minor_m * scale), -ellipse.angle_rad, given);
}

// Dashes cost a lot on long lines, and do not show there.
function lineOf(track, to, inner) {
  const flat = line(track, to, inner);
  return [flat, flat.length > mostDashed ? { ...track.style, dash: [] } : track.style];
}

function paintMarks(pen, track, to, scale, withEllipses) {
  for (const mark of track.marks) {
    const [x, y] = [to.x(mark.x_m), to.y(mark.y_m)];
    if (withEllipses) paintEllipse(pen, to, scale, mark.x_m, mark.y_m, mark.ellipse95, { colour: track.style.colour, opacity: 0.55 });
    pen.ellipse(x, y, 2.4, 2.4, 0, { fill: colour('ground'), colour: track.style.colour, width: 1.4 });
  }
}

function paintEnds(pen, track, to) {
  const last = track.x.length - 1;
  const [x, y] = [to.x(track.x[0]), to.y(track.y[0])];
  pen.polygon([x - 5, y - 5, x + 5, y - 5, x + 5, y + 5, x - 5, y + 5], { colour: colour('ink'), width: 1.5 });
  pen.ellipse(to.x(track.x[last]), to.y(track.y[last]), 4.5, 4.5, 0, { fill: track.style.colour, colour: colour('ground'), width: 1.5 });
}

function paintSlips(pen, spec, to, inner) {
  const main = spec.tracks.find((track) => track.isMain);
  if (!main) return;
  for (const slip of spec.slips) {
    const from = indexBefore(main.time, slip.from);
    const flat = line(main, to, inner, { from, end: indexBefore(main.time, slip.to) + 2 });
    pen.line(flat, { colour: colour('slip'), width: 14, opacity: 0.75 });
  }
}

// The last cloud: the heavier a particle, the darker.
function paintParticles(pen, spec, to) {
  if (!spec.particles) return;
  const { x, y, weight } = spec.particles;
  const heaviest = weight.reduce((most, one) => Math.max(most, one), 0);
  for (let i = 0; i < x.length; ++i) pen.ellipse(to.x(x[i]), to.y(y[i]), 2, 2, 0, { fill: colour('landmark'), fillOpacity: 0.15 + 0.5 * weight[i] / heaviest });
}

function paintLandmarks(pen, spec, to, scale) {
  const few = spec.landmarks.length < mostNames;
  for (const landmark of spec.landmarks) {
    const [x, y] = [to.x(landmark.x), to.y(landmark.y)];
    paintEllipse(pen, to, scale, landmark.x, landmark.y, landmark.ellipse, { fill: colour('landmark'), fillOpacity: 0.18, colour: colour('landmark') });
    pen.polygon([x, y - 5, x + 5, y, x, y + 5, x - 5, y], { fill: colour('landmark'), colour: colour('ground') });
    if (few) pen.text(x + 8, y - 6, landmark.label, { colour: colour('soft'), size: 11 });
  }
}

// Sightings within half a second of the cursor, from where the robot then was.
function paintSightings(pen, spec, to, time) {
  const track = spec.tracks.find((one) => one.isSightedFrom);
  if (!track || !spec.sightings) return;
  const { time: times, landmark, decision } = spec.sightings;
  for (let i = indexBefore(times, time); i >= 0 && time - times[i] < 0.5; --i) {
    const place = spec.landmarks[landmark[i]];
    const j = indexBefore(track.time, times[i]);
    const taken = decision[i] <= 1;
    if (place) pen.line([to.x(track.x[j]), to.y(track.y[j]), to.x(place.x), to.y(place.y)], { colour: colour(taken ? 'landmark' : 'outlier'), width: 1.2, dash: taken ? [] : [4, 3], opacity: 0.8 });
  }
}

// `hidden`: tracks that are not drawn; `bare`: tracks without the 95 % around them.
function paintAll(pen, spec, view, { hidden, bare }) {
  const to = projection(view);
  const { inner, scale } = view;
  const tracks = spec.tracks.filter((track) => !hidden.has(track));
  paintGrid(pen, to, inner, lengthUnit([to.toX(inner.left), to.toX(inner.right), to.toY(inner.top), to.toY(inner.bottom)]));
  pen.clip(inner);
  for (const track of tracks) if (!bare.has(track)) paintTube(pen, track, to, inner);
  paintSlips(pen, spec, to, inner);
  for (const track of tracks) pen.line(...lineOf(track, to, inner));
  for (const track of tracks) paintMarks(pen, track, to, scale, !bare.has(track));
  paintLandmarks(pen, spec, to, scale);
  paintParticles(pen, spec, to);
  for (const track of tracks) paintEnds(pen, track, to);
  pen.unclip();
}

// While it moves: lines without dashes and detail, no tubes.
function paintRoughly(pen, spec, view, hidden) {
  const to = projection(view);
  const { inner } = view;
  paintGrid(pen, to, inner, lengthUnit([to.toX(inner.left), to.toX(inner.right), to.toY(inner.top), to.toY(inner.bottom)]));
  pen.clip(inner);
  for (const track of spec.tracks) if (!hidden.has(track)) pen.line(line(track, to, inner, { finest: 6, stride: Math.ceil(track.x.length / roughPoints) }), { ...track.style, dash: [], width: Math.min(2, track.style.width) });
  pen.unclip();
}

function poseAt(track, time) {
  if (time < track.time[0] || time > track.time.at(-1)) return null;
  const i = indexBefore(track.time, time);
  const j = Math.min(i + 1, track.time.length - 1);
  const share = track.time[j] > track.time[i] ? (time - track.time[i]) / (track.time[j] - track.time[i]) : 0;
  const mix = (values) => values[i] + share * (values[j] - values[i]);
  return { x: mix(track.x), y: mix(track.y), heading: track.heading[i] };
}

function paintMoment(pen, spec, view, hidden, time) {
  const to = projection(view);
  const window = timeWindow();
  pen.clip(view.inner);
  for (const track of spec.tracks) {
    if (hidden.has(track)) continue;
    if (window && track.isMain) pen.line(line(track, to, view.inner, { from: indexBefore(track.time, window[0]), end: indexBefore(track.time, window[1]) + 1 }), { colour: track.style.colour, width: 5, opacity: 0.35 });
    const pose = time === null ? null : poseAt(track, time);
    if (!pose) continue;
    const [x, y] = [to.x(pose.x), to.y(pose.y)];
    if (!Number.isNaN(pose.heading)) pen.line([x, y, x + 16 * Math.cos(pose.heading), y - 16 * Math.sin(pose.heading)], { colour: colour('ink'), width: 2 });
    pen.ellipse(x, y, 5, 5, 0, { fill: track.style.colour, colour: colour('ink'), width: 1.5 });
  }
  if (time !== null) paintSightings(pen, spec, to, time);
  pen.unclip();
}

export function penOn(canvas, width, height) {
  const ratio = devicePixelRatio;
  canvas.width = width * ratio;
  canvas.height = height * ratio;
  const context = canvas.getContext('2d');
  context.scale(ratio, ratio);
  context.lineJoin = 'bevel';
  return canvasPen(context);
}

// The track and its pose that are nearest to a place in pixels.
function pick(spec, view, hidden, x, y) {
  const to = projection(view);
  let best = { distance: nearest, time: null };
  for (const track of spec.tracks) {
    if (hidden.has(track)) continue;
    for (let i = 0; i < track.x.length; ++i) {
      const distance = Math.hypot(to.x(track.x[i]) - x, to.y(track.y[i]) - y);
      if (distance < best.distance) best = { distance, time: track.time[i] };
    }
  }
  return best.time;
}

function reading(spec, hidden, time) {
  const words = spec.tracks.filter((track) => !hidden.has(track)).map((track) => {
    const pose = poseAt(track, time);
    if (!pose) return null;
    const unit = lengthUnit([1]);
    return `${track.label}: ${significant(pose.x * unit.factor, 4)}, ${significant(pose.y * unit.factor, 4)} ${unit.unit}`;
  }).filter(Boolean);
  return `t ${fixed(time, 2)} s · ${words.join(' · ')}`;
}

// Buttons that show and hide tracks, and the 95 % around those that are drawn without at first.
function keyOf(spec, { hidden, bare }, redraw) {
  const toggle = (track, without, words, sample) => {
    const button = html('button', { type: 'button', class: 'toggle', 'aria-pressed': String(!without.has(track)), title: words }, sample, words);
    button.addEventListener('click', () => {
      if (!without.delete(track)) without.add(track);
      button.setAttribute('aria-pressed', String(!without.has(track)));
      redraw();
    });
    return html('li', {}, button);
  };
  const entries = spec.tracks.map((track) => [toggle(track, hidden, track.label, lineSample(track.style)),
    bare.has(track) ? toggle(track, bare, text.map.bands(track.label), lineSample({ ...track.style, width: 12, dash: [], opacity: 0.25 })) : null]);
  return html('ul', { class: 'legend toggles' }, entries);
}

// spec: {label, tracks: [{label, short, time, x, y, heading, across?, marks, style, isMain?, isSightedFrom?, isBare?}],
//   landmarks: [{label, x, y, ellipse}], particles: {x, y, weight} | null, sightings: {time, landmark, decision} | null, slips: [{from, to}]};
// returns {node, svg(), zoom(), reset()}.
export function map(spec) {
  const still = html('canvas', { class: 'still' });
  const moving = html('canvas', { class: 'moving' });
  const box = html('div', { class: 'map', tabindex: '0', role: 'img', 'aria-label': `${spec.label}. ${text.plot.keys}` }, still, moving);
  const readout = html('p', { class: 'readout', 'aria-hidden': 'true' }, '\u00a0');
  const hidden = new Set();
  const bare = new Set(spec.tracks.filter(({ isBare }) => isBare));
  const without = { hidden, bare };
  const bounds = boundsOf(spec);
  let size = null;
  let view = null;
  let asked = false;

  const paint = () => {
    asked = false;
    if (!size) return;
    paintAll(penOn(still, ...size), spec, view, without);
    paintMoment(penOn(moving, ...size), spec, view, hidden, cursorTime());
  };
  const redraw = () => {
    if (!asked) requestAnimationFrame(paint);
    asked = true;
  };
  // Large ones are drawn roughly while they move.
  const large = spec.tracks.reduce((sum, track) => sum + track.x.length, 0) > mostAtOnce;
  let settle = 0;
  const moved = () => {
    if (!large) return redraw();
    clearTimeout(settle);
    settle = setTimeout(redraw, 180);
    if (asked) return undefined;
    asked = true;
    return requestAnimationFrame(() => {
      asked = false;
      paintRoughly(penOn(still, ...size), spec, view, hidden);
      paintMoment(penOn(moving, ...size), spec, view, hidden, null);
    });
  };
  const whole = () => {
    view = viewOf(bounds, ...size);
    redraw();
  };
  const moves = {
    pan: (dx, dy) => {
      view.centre = { x: view.centre.x + (dx * size[0]) / view.scale, y: view.centre.y - (dy * size[1]) / view.scale };
      moved();
    },
    zoom: (by, at = { x: 0.5, y: 0.5 }) => {
      const [x, y] = [at.x * size[0], at.y * size[1]];
      const before = projection(view);
      const fixedPoint = { x: before.toX(x), y: before.toY(y) };
      view.scale *= by;
      const after = projection(view);
      view.centre = { x: view.centre.x + fixedPoint.x - after.toX(x), y: view.centre.y + fixedPoint.y - after.toY(y) };
      moved();
    },
    reset: whole,
  };
  listen(box, box, moves);
  box.addEventListener('pointermove', (event) => {
    if (!size || event.buttons !== 0) return;
    const at = box.getBoundingClientRect();
    const time = pick(spec, view, hidden, event.clientX - at.left, event.clientY - at.top);
    if (time !== null) setCursor(time, box);
  });
  on('cursor', (time) => {
    if (time !== null) readout.textContent = reading(spec, hidden, time);
    if (size) paintMoment(penOn(moving, ...size), spec, view, hidden, time);
  });
  on('window', () => size && isSeen(box) && paintMoment(penOn(moving, ...size), spec, view, hidden, cursorTime()));
  on('place', ({ points }) => {
    if (!size || points.length === 0) return;
    const near = { x: extent(points.map(({ x }) => x)), y: extent(points.map(({ y }) => y)) };
    const widened = ([low, high]) => [low - 0.5, high + 0.5];
    view = viewOf({ x: widened(near.x), y: widened(near.y) }, ...size);
    redraw();
    box.scrollIntoView({ block: 'center', behavior: 'smooth' });
  });
  const fit = () => {
    const width = Math.floor(box.clientWidth);
    if (width === 0 || width === size?.[0]) return;
    size = [width, Math.round(Math.min(Math.max(320, width * 0.62), 620))];
    box.style.height = `${size[1]}px`;
    view = viewOf(bounds, ...size);
    paint();
  };
  new ResizeObserver(() => soon(fit)).observe(box);
  on('fit', fit);
  const drawing = () => asSvg(...size, (pen) => paintAll(pen, spec, view, without), spec.label);
  return { node: html('div', {}, box, readout, keyOf(spec, without, redraw)), svg: drawing, zoom: moves.zoom, reset: moves.reset };
}
