// Numbers as a person reads them. JSON holds SI units and radians; here they become what the reader chose.
import { setting } from './settings.js';
import { text } from './strings/en.js';

export const unknown = '–';

const degree = 180 / Math.PI;
const inch = 0.0254;

// How to show a unit of the data: multiply by factor, write unit.
export function display(unit) {
  const metric = setting('lengths') === 'metric';
  const degrees = setting('angles') === 'degrees';
  const displayed = {
    m: metric ? { factor: 1000, unit: 'mm' } : { factor: 1 / inch, unit: 'in' },
    rad: degrees ? { factor: degree, unit: '°' } : { factor: 1, unit: 'rad' },
    'rad/s': degrees ? { factor: degree, unit: '°/s' } : { factor: 1, unit: 'rad/s' },
    s: { factor: 1000, unit: 'ms' },
    1: { factor: 1, unit: '' },
  };
  return displayed[unit] ?? { factor: 1, unit };
}

// One length unit for all the values of a table or an axis.
export function lengthUnit(metres) {
  if (setting('lengths') !== 'metric') return { factor: 1 / inch, unit: 'in' };
  const largest = Math.max(0, ...metres.filter(isNumber).map(Math.abs));
  return largest < 1 ? { factor: 1000, unit: 'mm' } : { factor: 1, unit: 'm' };
}

export function isNumber(value) {
  return typeof value === 'number' && Number.isFinite(value);
}

function withMinus(words) {
  return words.replace('-', '−');
}

// With so many decimals that `resolution` shows two significant digits.
export function decimalsFor(resolution) {
  if (!isNumber(resolution) || resolution <= 0) return 4;
  return Math.min(9, Math.max(0, 1 - Math.floor(Math.log10(resolution))));
}

export function fixed(value, decimals) {
  return isNumber(value) ? withMinus(value.toFixed(decimals)) : unknown;
}

export function significant(value, digits = 3) {
  if (!isNumber(value)) return unknown;
  if (value === 0) return '0';
  const magnitude = Math.abs(value);
  if (magnitude >= 1e6 || magnitude < 1e-4) return withMinus(value.toExponential(digits - 1).replace('e', ' e'));
  return withMinus(value.toFixed(Math.max(0, digits - 1 - Math.floor(Math.log10(magnitude)))));
}

export function inUnit(value, { factor, unit }, digits = 3) {
  return isNumber(value) ? joined(significant(value * factor, digits), unit) : unknown;
}

// value ± sigma with the digits that sigma warrants.
export function withSigma(value, sigma, { factor, unit }) {
  if (!isNumber(sigma) || sigma <= 0) return inUnit(value, { factor, unit }, 4);
  const decimals = decimalsFor(sigma * factor);
  return `${fixed(value * factor, decimals)} ± ${joined(fixed(sigma * factor, decimals), unit)}`;
}

export function lengthWithSigma(metres, sigma) {
  return withSigma(metres, sigma, lengthUnit([metres]));
}

// A single length in the unit that suits it.
export function length(metres) {
  return inUnit(metres, lengthUnit([metres]));
}

export function percent(share, digits = 2) {
  return `${significant(100 * share, digits)} %`;
}

export function joined(number, unit) {
  return unit === '°' || unit === '' ? number + unit : number + ' ' + unit;
}

// "9.6 times smaller", "1.2 times larger", "about the same", nothing when one is missing.
export function ratioInWords(before, after) {
  if (!isNumber(before) || !isNumber(after) || before <= 0 || after <= 0) return '';
  const ratio = before / after;
  if (ratio > 0.95 && ratio < 1.05) return text.ratio.same;
  return ratio > 1 ? text.ratio.smaller(significant(ratio, 2)) : text.ratio.larger(significant(1 / ratio, 2));
}
