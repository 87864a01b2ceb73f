// Where closed runs end: measured minus odometry, clockwise and counter-clockwise, before and after.
import { fullName, html, responsive, shortened, svg } from '../dom.js';
import { isNumber, length } from '../format.js';
import { boundsOf, plane, squareAround } from '../plane.js';
import { legend, section, tooledSvg } from '../section.js';
import { text } from '../strings/en.js';

function pointsOf(scatter) {
  return scatter.x_m.map((x, i) => ({ x, y: scatter.y_m[i], run: scatter.run[i] })).filter(({ x, y }) => isNumber(x) && isNumber(y));
}

// What must be in the picture: the points, and the corners of the ellipse's box.
function extentOf(scatter) {
  const { ellipse95: ellipse, centroid_x_m: x, centroid_y_m: y } = scatter;
  if (!ellipse) return pointsOf(scatter);
  const cos = Math.cos(ellipse.angle_rad);
  const sin = Math.sin(ellipse.angle_rad);
  const half = { x: Math.hypot(ellipse.semi_major_m * cos, ellipse.semi_minor_m * sin), y: Math.hypot(ellipse.semi_major_m * sin, ellipse.semi_minor_m * cos) };
  return [...pointsOf(scatter), { x: x - half.x, y: y - half.y }, { x: x + half.x, y: y + half.y }];
}

function marker(turn, x, y, kind, title) {
  const shape = turn === 'cw' ? svg('circle', { cx: x, cy: y, r: 4, class: `end ${kind}` })
    : svg('path', { d: `M${x} ${y - 5.2}l4.8 8.4h-9.6z`, class: `end ${kind}` });
  shape.append(svg('title', {}, title));
  return shape;
}

function drawScatter(frame, group, kind, runs) {
  const scatter = group[kind];
  const held = group.hold_out ? 'held-out' : '';
  const { centroid_x_m: cx, centroid_y_m: cy, ellipse95: ellipse } = scatter;
  const [x, y] = [frame.x(cx), frame.y(cy)];
  if (ellipse) {
    frame.marks.append(svg('ellipse', { class: `ellipse ${kind}`, cx: x, cy: y, rx: ellipse.semi_major_m * frame.scale, ry: ellipse.semi_minor_m * frame.scale,
      transform: `rotate(${(-ellipse.angle_rad * 180) / Math.PI} ${x} ${y})` }));
  }
  const several = pointsOf(scatter).length > 1;
  if (several) frame.marks.append(svg('path', { class: `spoke ${kind}`, d: `M${frame.x(0)} ${frame.y(0)}L${x} ${y}` }));
  for (const point of pointsOf(scatter)) {
    frame.marks.append(marker(group.turn, frame.x(point.x), frame.y(point.y), `${kind} ${held}`,
      `${runs[point.run] ? shortened(fullName(runs[point.run])) : ''}, ${text.endpoints.turns[group.turn] ?? ''}, ${text.endpoints[kind]}`));
  }
  if (several) frame.marks.append(svg('path', { class: `centroid ${kind}`, d: `M${x - 7} ${y}h14M${x} ${y - 7}v14` }));
}

function panel(width, { groups, runs }, kinds, bounds, label, zoomed) {
  const height = Math.min(width * 0.95, 460);
  const frame = plane({ width, height, bounds, label, names: { x: text.endpoints.ahead, y: text.endpoints.left } });
  const { left, right, top, bottom } = frame.inner;
  frame.marks.append(svg('path', { class: 'origin', d: `M${left} ${frame.y(0)}H${right}M${frame.x(0)} ${top}V${bottom}` }));
  if (zoomed) {
    const [x, y] = [frame.x(zoomed.x[0]), frame.y(zoomed.y[1])];
    frame.marks.append(svg('rect', { class: 'zoomed', x, y, width: frame.x(zoomed.x[1]) - x, height: frame.y(zoomed.y[0]) - y }));
  }
  for (const kind of kinds) {
    for (const group of groups) {
      if (group[kind]) drawScatter(frame, group, kind, runs);
    }
  }
  return frame.root;
}

function labelOf(groups) {
  const part = (group, kind) => group[kind] && `${text.endpoints[kind]} ${length(group[kind].centroid_distance_m)}`;
  return groups.map((group) => text.endpoints.group(text.endpoints.turns[group.turn] ?? group.turn, group.hold_out, group.before.run.length, [part(group, 'before'), part(group, 'after')].filter(Boolean).join(', '))).join('; ');
}

function titled(title, drawing) {
  return html('div', { class: 'panel' }, html('h4', {}, title), tooledSvg(drawing, `${text.endpoints.title}, ${title}`));
}

export function endpoints(calibration) {
  const groups = calibration.end_points.filter((group) => pointsOf(group.before).length > 0);
  if (groups.length === 0) return null;
  const origin = { x: 0, y: 0 };
  const all = (kind) => groups.flatMap((group) => (group[kind] ? extentOf(group[kind]) : []));
  const anyAfter = all('after').length > 0;
  const near = squareAround(boundsOf([origin, ...all('after')], 2e-3));
  const far = squareAround(boundsOf([origin, ...all('before'), ...all('after')], 2e-3));
  const label = `${text.endpoints.title}. ${labelOf(groups)}.`;
  const shown = { groups, runs: calibration.runs };
  const before = responsive((width) => panel(width, shown, ['before', 'after'], far, label, anyAfter ? near : null));
  const after = anyAfter ? responsive((width) => panel(width, shown, ['after'], near, `${label} ${text.endpoints.enlarged}`)) : null;
  return section(text.endpoints,
    html('div', { class: 'panels' }, titled(anyAfter ? text.endpoints.both : text.endpoints.onlyBefore, before), after ? titled(text.endpoints.onlyAfter, after) : null),
    legend(['dot before', text.endpoints.before], ['dot after', text.endpoints.after], ['dot soft', text.endpoints.turns.cw], ['triangle', text.endpoints.turns.ccw], ['cross', text.endpoints.centroid], ...(groups.some((group) => group.hold_out) ? [['circle', text.endpoints.heldOut]] : [])));
}
