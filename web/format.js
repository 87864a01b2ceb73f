// Numbers as a person reads them. JSON holds SI units and radians; here they become millimetres and degrees.

export const unknown = '–';

const degree = 180 / Math.PI;
const displayed = {
  m: { factor: 1000, unit: 'mm' },
  rad: { factor: degree, unit: '°' },
  'rad/s': { factor: degree, unit: '°/s' },
  s: { factor: 1000, unit: 'ms' },
  1: { factor: 1, unit: '' },
};

// How to show a unit of the data: multiply by factor, write unit.
export function display(unit) {
  return displayed[unit] ?? { factor: 1, unit };
}

// One length unit for all the values of a table or an axis.
export function lengthUnit(metres) {
  const largest = Math.max(0, ...metres.filter(isNumber).map(Math.abs));
  return largest < 1 ? { factor: 1000, unit: 'mm' } : { factor: 1, unit: 'm' };
}

export function isNumber(value) {
  return typeof value === 'number' && Number.isFinite(value);
}

function withMinus(text) {
  return text.replace('-', '−');
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

// A single length in the unit that suits it.
export function length(metres) {
  return inUnit(metres, lengthUnit([metres]));
}

export function joined(number, unit) {
  return unit === '°' || unit === '' ? number + unit : number + ' ' + unit;
}

// "9.6 times smaller", "1.2 times larger", "about the same", nothing when one is missing.
export function ratioInWords(before, after) {
  if (!isNumber(before) || !isNumber(after) || before <= 0 || after <= 0) return '';
  const ratio = before / after;
  if (ratio > 0.95 && ratio < 1.05) return 'about the same';
  return ratio > 1 ? significant(ratio, 2) + ' times smaller' : significant(1 / ratio, 2) + ' times larger';
}

export function plural(count, noun) {
  return count + ' ' + noun + (count === 1 ? '' : 's');
}
