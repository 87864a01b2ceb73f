// The online estimate as it grew: path and map as they were known at the moment of a slider, which plays; below, how far
// sightings moved the pose.
import { chart } from '../chart.js';
import { extent, indexBefore } from '../column.js';
import { html } from '../dom.js';
import { fixed, lengthUnit } from '../format.js';
import { line, paintEllipse, paintGrid, penOn, projection, viewOf } from '../map.js';
import { colour, trackStyle } from '../palette.js';
import { asSvg } from '../pens.js';
import { section, tooled } from '../section.js';
import { on, setCursor, soon } from '../shared.js';
import { text } from '../strings/en.js';

const whole = 12000; // ms that all of it plays for
const mostDiamonds = 120; // landmarks that have one: more would cover the picture

// Of several robots each has the colour of its track on the map.
function colourOf(robot, tracks, otherwise) {
  const others = tracks.filter(({ role }) => role === 'other');
  return robot ? `result-${others.findIndex(({ name }) => name === robot) % 6}` : otherwise;
}

function paintRobot(pen, view, to, { snapshot, own, ofMap }) {
  const { inner, scale } = view;
  const { path, landmarks } = snapshot;
  landmarks.x_m.forEach((x, i) => {
    const [left, top] = [to.x(x), to.y(landmarks.y_m[i])];
    const ellipse = { semi_major_m: landmarks.semi_major_m[i], semi_minor_m: landmarks.semi_minor_m[i], angle_rad: landmarks.angle_rad[i] };
    paintEllipse(pen, to, scale, x, landmarks.y_m[i], ellipse, { fill: colour(ofMap), fillOpacity: 0.18, colour: colour(ofMap) });
    if (landmarks.x_m.length <= mostDiamonds) pen.polygon([left, top - 5, left + 5, top, left, top + 5, left - 5, top], { fill: colour(ofMap), colour: colour('ground') });
  });
  pen.line(line({ x: path.x_m, y: path.y_m }, to, inner), { ...trackStyle('online'), colour: colour(own), dash: [] });
  const [x, y] = [to.x(snapshot.x_m), to.y(snapshot.y_m)];
  paintEllipse(pen, to, scale, snapshot.x_m, snapshot.y_m, snapshot.ellipse95, { colour: colour(own), fill: colour(own), fillOpacity: 0.18 });
  pen.line([x, y, x + 16 * Math.cos(snapshot.heading_rad), y - 16 * Math.sin(snapshot.heading_rad)], { colour: colour('ink'), width: 2 });
  pen.ellipse(x, y, 5, 5, 0, { fill: colour(own), colour: colour('ink'), width: 1.5 });
}

function paint(pen, view, { reference, robots }) {
  const to = projection(view);
  const { inner } = view;
  paintGrid(pen, to, inner, lengthUnit([to.toX(inner.left), to.toX(inner.right), to.toY(inner.top), to.toY(inner.bottom)]));
  pen.clip(inner);
  if (reference) pen.line(line(reference, to, inner), trackStyle('reference'));
  for (const robot of robots) paintRobot(pen, view, to, robot);
  pen.unclip();
}

function boundsOf(grown, reference) {
  const all = (name) => extent(...grown.flatMap(({ snapshots }) => snapshots).flatMap(({ path, landmarks }) => [path[name], landmarks[name]]), ...(reference ? [name === 'x_m' ? reference.x : reference.y] : [])) ?? [-1, 1];
  return { x: all('x_m'), y: all('y_m') };
}

// {node, svg()}: the picture, its slider and its button.
function player(grown, tracks, reference) {
  const words = text.growth;
  const stamps = grown.map(({ snapshots }) => snapshots.map(({ time_s: time }) => time));
  const times = [...new Set(stamps.flat())].sort((a, b) => a - b);
  const canvas = html('canvas', { class: 'still' });
  const box = html('div', { class: 'map growth', role: 'img', 'aria-label': words.label }, canvas);
  const slider = html('input', { type: 'range', min: 0, max: times.length - 1, step: 1, value: times.length - 1, 'aria-label': words.slider });
  const button = html('button', { type: 'button', class: 'play' }, words.play);
  const readout = html('output', {});
  const bounds = boundsOf(grown, reference);
  let shown = times.length - 1;
  let size = null;
  let playing = 0; // 0: it does not; else what cancels it

  const robots = () => grown.map(({ robot, snapshots }, i) => ({ robot, snapshot: snapshots[indexBefore(stamps[i], times[shown])], own: colourOf(robot, tracks, 'track-online'), ofMap: colourOf(robot, tracks, 'landmark') }));
  const picture = (pen) => paint(pen, viewOf(bounds, ...size), { reference, robots: robots() });
  const draw = () => {
    if (size) picture(penOn(canvas, ...size));
    slider.value = shown;
    readout.textContent = words.at(fixed(times[shown], 1), robots().map(({ robot, snapshot }) => ({ robot, landmarks: snapshot.landmarks.x_m.length })));
    slider.setAttribute('aria-valuetext', readout.textContent);
  };
  const show = (index, source) => {
    if (index === shown) return;
    shown = index;
    draw();
    if (source !== 'cursor') setCursor(times[shown], box);
  };
  const stop = () => {
    cancelAnimationFrame(playing);
    playing = 0;
    button.textContent = words.play;
  };
  const play = () => {
    const first = shown === times.length - 1 ? 0 : shown;
    const start = performance.now() - (whole * first) / times.length;
    const frame = (now) => {
      const index = Math.max(0, Math.floor(((now - start) / whole) * times.length));
      show(Math.min(index, times.length - 1));
      if (index >= times.length - 1 || !box.isConnected) stop();
      else playing = requestAnimationFrame(frame);
    };
    button.textContent = words.pause;
    playing = requestAnimationFrame(frame);
  };
  button.addEventListener('click', () => (playing ? stop() : play()));
  slider.addEventListener('input', () => {
    stop();
    show(Number(slider.value));
  });
  on('cursor', (time, source) => {
    if (time !== null && source !== box && !playing) show(indexBefore(times, time), 'cursor');
  });
  const fit = () => {
    const width = Math.floor(box.clientWidth);
    if (width === 0 || width === size?.[0]) return;
    size = [width, Math.round(Math.min(Math.max(320, width * 0.62), 620))];
    box.style.height = `${size[1]}px`;
    draw();
  };
  new ResizeObserver(() => soon(fit)).observe(box);
  on('fit', fit);
  const node = html('div', {}, box, html('div', { class: 'player' }, button, slider, readout));
  return { node, svg: () => asSvg(...size, picture, words.label) };
}

function movedChart(grown, tracks) {
  const columns = grown.map(({ moved }) => moved.columns());
  if (!columns.some(({ moved_m: moved }) => moved.some((value) => value > 0))) return null;
  const words = text.growth;
  const series = columns.map(({ time_s: x, moved_m: y }, i) => ({ name: grown[i].robot || words.moved, x, y, style: { colour: colour(colourOf(grown[i].robot, tracks, 'track-online')), width: 1.3, dash: [] } }));
  const unit = lengthUnit(columns.flatMap(({ moved_m: moved }) => [...moved]));
  return tooled(chart({ label: words.moved, height: 180, x: { name: text.plot.time, short: text.plot.timeShort, unit: 's', isTime: true }, y: { name: words.moved, unit, from: 0 }, series }), words.moved);
}

export function growth([result]) {
  const grown = result.growth.filter(({ snapshots }) => snapshots.length > 1);
  if (grown.length === 0) return null;
  const found = result.tracks.find(({ role }) => role === 'reference')?.columns();
  const reference = found && { x: found.x_m, y: found.y_m };
  return section(text.growth, tooled(player(grown, result.tracks, reference), text.growth.title), movedChart(grown, result.tracks));
}
