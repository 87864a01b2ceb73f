// One run from above, chosen by name: nominal, calibrated, reference; and how far each is from the reference.
import { fullName, html, responsive, shortened, svg } from '../dom.js';
import { isNumber, lengthUnit } from '../format.js';
import { boundsOf, lineThrough, plane } from '../plane.js';
import { linear, ticks, tickText } from '../scale.js';
import { legend, section, tooledSvg } from '../section.js';
import { text } from '../strings/en.js';

const kinds = ['reference', 'nominal', 'calibrated'];

function pointsOf(trajectory) {
  return trajectory.x_m.map((x, i) => ({ x, y: trajectory.y_m[i] })).filter(({ x, y }) => isNumber(x) && isNumber(y));
}

function fromAbove(run, width) {
  const points = kinds.flatMap((kind) => pointsOf(run.trajectories[kind]));
  const bounds = boundsOf(points, 0.05);
  const ratio = (bounds.y[1] - bounds.y[0]) / (bounds.x[1] - bounds.x[0]);
  const height = Math.round(Math.min(Math.max(width * ratio, width * 0.45), 560, width * 1.1)) + 50;
  const frame = plane({ width, height, bounds, label: text.trajectories.label(shortened(fullName(run))) });
  for (const kind of kinds) {
    const trajectory = run.trajectories[kind];
    frame.marks.append(svg('path', { class: `track ${kind}`, d: lineThrough(trajectory, frame.x, frame.y) }));
  }
  for (const kind of kinds) {
    const last = pointsOf(run.trajectories[kind]).at(-1);
    if (last) frame.marks.append(svg('circle', { class: `finish ${kind}`, cx: frame.x(last.x), cy: frame.y(last.y), r: 4.5 }));
  }
  const first = points[0];
  if (first) frame.marks.append(svg('path', { class: 'start', d: `M${frame.x(first.x) - 5} ${frame.y(first.y) - 5}h10v10h-10z` }, svg('title', {}, text.trajectories.start)));
  return frame.root;
}

function range(values) {
  return values.reduce(([low, high], value) => (isNumber(value) ? [Math.min(low, value), Math.max(high, value)] : [low, high]), [Infinity, -Infinity]);
}

function deviationAxes(frame, unit, way) {
  const { left, right, top, bottom } = frame.inner;
  const rows = ticks(0, frame.highest * unit.factor, 4);
  const columns = ticks(...frame.span.map((metres) => metres * way.factor), (right - left) / 80);
  const step = (values) => (values.length > 1 ? values[1] - values[0] : 1);
  return [
    rows.map((value) => [svg('path', { class: 'grid', d: `M${left} ${frame.y(value / unit.factor)}H${right}` }),
      svg('text', { class: 'tick', x: left - 6, y: frame.y(value / unit.factor) + 4, 'text-anchor': 'end' }, tickText(value, step(rows)))]),
    columns.map((value) => svg('text', { class: 'tick', x: frame.x(value / way.factor), y: bottom + 16, 'text-anchor': 'middle' }, tickText(value, step(columns)))),
    svg('text', { class: 'axis', x: (left + right) / 2, y: bottom + 32, 'text-anchor': 'middle' }, text.plot.way(way.unit)),
    svg('text', { class: 'axis', x: left, y: top - 8 }, text.trajectories.distance(unit.unit)),
  ].flat(2);
}

function deviation(run, width) {
  const { path_m: path, nominal_m: nominal, calibrated_m: calibrated } = run.deviation;
  const height = 170;
  const inner = { left: 46, right: width - 12, top: 24, bottom: height - 38 };
  const highest = Math.max(1e-6, range(nominal)[1], range(calibrated)[1]);
  const span = range(path);
  const frame = { inner, highest, span, x: linear(span, [inner.left, inner.right]), y: linear([0, highest], [inner.bottom, inner.top]) };
  const curve = (kind, values) => svg('path', { class: `track ${kind}`, d: lineThrough({ x_m: path, y_m: values }, frame.x, frame.y) });
  return svg('svg', { class: 'plot', width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': text.trajectories.alongLabel(shortened(fullName(run))) },
    deviationAxes(frame, lengthUnit([highest]), lengthUnit([10])), curve('nominal', nominal), curve('calibrated', calibrated));
}

function drawable(run) {
  return run.trajectories && kinds.some((kind) => pointsOf(run.trajectories[kind]).length > 1);
}

function chooser(runs, choose) {
  const option = (run, i) => html('option', { value: i }, `${shortened(fullName(run), 60)}${run.hold_out ? text.trajectories.heldOut : ''}`);
  const select = html('select', {}, runs.map(option));
  const step = (by) => {
    select.selectedIndex = (select.selectedIndex + by + runs.length) % runs.length;
    choose(runs[select.selectedIndex]);
  };
  const button = (text, name, by) => {
    const node = html('button', { type: 'button', 'aria-label': name }, text);
    node.addEventListener('click', () => step(by));
    return node;
  };
  select.addEventListener('change', () => step(0));
  return html('p', { class: 'chooser' }, html('label', {}, html('span', {}, text.trajectories.run), select), runs.length > 1 ? [button('‹', text.trajectories.previous, -1), button('›', text.trajectories.next, 1)] : null);
}

// A held-out run first: it shows what calibration is worth.
function inOrder(runs) {
  return [...runs.filter((run) => run.hold_out), ...runs.filter((run) => !run.hold_out)];
}

export function trajectories(calibration) {
  const runs = inOrder(calibration.runs.filter(drawable));
  if (runs.length === 0) return null;
  let chosen = runs[0];
  const above = responsive((width) => fromAbove(chosen, width));
  const along = responsive((width) => (chosen.deviation ? deviation(chosen, width) : svg('svg', { width: 0, height: 0 })));
  const choose = (run) => {
    chosen = run;
    above.redraw();
    along.redraw();
  };
  return section(text.trajectories, chooser(runs, choose), tooledSvg(above, text.trajectories.title), tooledSvg(along, text.trajectories.alongTitle),
    legend(['stroke nominal', text.trajectories.nominal], ['stroke calibrated', text.trajectories.calibrated], ['stroke reference', text.trajectories.reference]));
}
