// Units of the data as the page shows them.
const degree = 180 / Math.PI;
const shown = { m: { factor: 1000, unit: 'mm' }, rad: { factor: degree, unit: '°' }, 'rad/s': { factor: degree, unit: '°/s' }, s: { factor: 1000, unit: 'ms' }, 1: { factor: 1, unit: '' } };

export function shownIn(unit) {
  return shown[unit] ?? { factor: 1, unit };
}
