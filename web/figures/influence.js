// How each parameter settles with the number of runs, and how much hangs on single ones.
import { html, nameOf, responsive } from '../dom.js';
import { display, fixed, decimalsFor, isNumber, joined } from '../format.js';
import { colour } from '../palette.js';
import { asSvg } from '../pens.js';
import { linear, ticks, tickText } from '../scale.js';
import { legend, section, tooledSvg } from '../section.js';
import { text } from '../strings/en.js';

const height = 190;
const settled = 8; // final standard deviations: what lies farther, before enough runs told it, is cut off

function rangeOf({ without, after, sigma_after: sigma }) {
  const last = sigma.length - 1;
  const near = [...without, ...after.filter((value, i) => sigma[i] < settled * sigma[last]), after[last] - 3 * sigma[last], after[last] + 3 * sigma[last]].filter(isNumber);
  const [low, high] = [Math.min(...near), Math.max(...near)];
  const air = 0.06 * (high - low);
  return [low - air, high + air];
}

function axes(pen, inner, x, y, runs, range, factor) {
  const soft = { colour: colour('soft'), size: 11 };
  const rows = ticks(range[0] * factor, range[1] * factor, 4);
  for (const value of rows) {
    pen.line([inner.left, y(value / factor), inner.right, y(value / factor)], { colour: colour('grid') });
    pen.text(inner.left - 6, y(value / factor) + 4, tickText(value, rows[1] - rows[0] || 1), { ...soft, align: 'right' });
  }
  const every = Math.max(1, Math.ceil(runs / 10));
  for (let run = 1; run <= runs; run += every) pen.text(x(run), inner.bottom + 15, String(run), { ...soft, align: 'center' });
  pen.text((inner.left + inner.right) / 2, inner.bottom + 31, text.influence.runs, { ...soft, align: 'center' });
}

function draw(parameter, factor, width) {
  const { without, after, sigma_after: sigma } = parameter;
  const inner = { left: 62, right: width - 8, top: 8, bottom: height - 36 };
  const range = rangeOf(parameter);
  const x = linear([0.5, after.length + 0.5], [inner.left, inner.right]);
  const upright = linear(range, [inner.bottom, inner.top]);
  const y = (value) => Math.min(inner.bottom + 40, Math.max(inner.top - 40, upright(value)));
  const curve = (of) => after.flatMap((value, i) => [x(i + 1), y(of(value, sigma[i]))]);
  const upper = curve((value, s) => value + 1.96 * s);
  const lower = curve((value, s) => value - 1.96 * s);
  const back = after.flatMap((value, i) => lower.slice(2 * (after.length - 1 - i), 2 * (after.length - i)));
  const blue = colour('after');
  return asSvg(width, height, (pen) => {
    axes(pen, inner, x, upright, after.length, range, factor);
    pen.clip(inner);
    pen.polygon([...upper, ...back], { fill: blue, fillOpacity: 0.14 });
    pen.line(curve((value) => value), { colour: blue, width: 1.8 });
    without.forEach((value, i) => isNumber(value) && pen.ellipse(x(i + 1), y(value), 3, 3, 0, { fill: colour('before'), colour: colour('ground') }));
    pen.unclip();
  }, text.influence.label(parameter.name));
}

function panel(parameter, unit) {
  const shown = display(unit);
  const last = parameter.after.length - 1;
  const decimals = decimalsFor(parameter.sigma_after[last] * shown.factor);
  const title = [nameOf(parameter.name, 30), html('span', { class: 'soft' }, ` ${joined(fixed(parameter.after[last] * shown.factor, decimals), shown.unit)}`)];
  return html('div', { class: 'panel' }, html('h4', {}, title), tooledSvg(responsive((width) => draw(parameter, shown.factor, width)), `${text.influence.title}, ${parameter.name}`));
}

export function influence(calibration) {
  const found = calibration.influence?.parameters ?? [];
  if (found.length === 0 || found[0].after.length < 2) return null;
  const unitOf = (name) => calibration.parameters.find((parameter) => parameter.name === name)?.unit ?? '1';
  return section(text.influence, html('div', { class: 'panels' }, found.map((parameter) => panel(parameter, unitOf(parameter.name)))),
    legend(['stroke calibrated', text.influence.after], ['bar thick after', text.influence.band], ['dot before', text.influence.without]));
}
