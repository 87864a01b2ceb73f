// Correlation matrix: teal for together, brown for against; the number in every cell.
import { responsive, shortened, svg } from '../dom.js';
import { isNumber, unknown } from '../format.js';
import { section, tooledSvg } from '../section.js';
import { text } from '../strings/en.js';

function twoDecimals(value) {
  return value.toFixed(2).replace('-', '−');
}

function cell(value, x, y, size, title) {
  const strength = isNumber(value) ? Math.min(1, Math.abs(value)) : 0;
  const kind = value >= 0 ? 'together' : 'against';
  return svg('g', { class: `cell ${kind} ${strength > 0.55 ? 'strong' : ''}` }, svg('title', {}, title),
    svg('rect', { class: 'ground', x, y, width: size - 2, height: size - 2, rx: 3 }),
    svg('rect', { x, y, width: size - 2, height: size - 2, rx: 3, 'fill-opacity': strength.toFixed(3) }),
    size > 30 && isNumber(value) ? svg('text', { x: x + size / 2 - 1, y: y + size / 2 + 3, 'text-anchor': 'middle' }, twoDecimals(value)) : null);
}

function draw(names, matrix, width) {
  const short = names.map((name) => shortened(name, 18));
  const longest = Math.max(...short.map((name) => name.length));
  const left = Math.min(longest * 7 + 10, width * 0.38);
  const top = Math.min(120, longest * 4.6 + 16);
  const size = Math.min(64, (width - left - 8) / names.length);
  const height = top + size * names.length + 6;
  const root = svg('svg', { class: 'plot', width, height, viewBox: `0 0 ${width} ${height}`, role: 'img', 'aria-label': text.correlation.label(short.join(', ')) });
  names.forEach((name, i) => {
    const middle = size * (i + 0.5);
    root.append(svg('text', { class: 'label', x: left - 8, y: top + middle + 3, 'text-anchor': 'end' }, short[i]),
      svg('text', { class: 'label', x: left + middle, y: top - 8, transform: `rotate(-40 ${left + middle} ${top - 8})` }, short[i]));
    matrix[i].forEach((value, j) => root.append(cell(value, left + size * j, top + size * i, size, text.correlation.cell(short[i], short[j], isNumber(value) ? twoDecimals(value) : unknown))));
  });
  return root;
}

export function correlation(calibration) {
  const { names, within, total } = calibration.correlation;
  const betweenKnown = calibration.parameters.some((parameter) => parameter.sigma_between !== null) && total.length > 0;
  const matrix = betweenKnown ? total : within;
  if (names.length < 2 || matrix.length === 0) return null;
  return section({ ...text.correlation, how: text.correlation.how(betweenKnown) }, tooledSvg(responsive((width) => draw(names, matrix, width)), text.correlation.title));
}
