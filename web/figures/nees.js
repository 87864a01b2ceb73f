// Errors in units of the stated covariance, with the bounds of a consistent one.
import { chart } from '../chart.js';
import { lineLegend, section, tooled } from '../section.js';
import { text } from '../strings/en.js';
import { curvesOf, wayAxis } from './error_along.js';

export function nees(results) {
  const curves = curvesOf(results).filter(({ columns }) => columns.nees && columns.nees.some((value) => value > 0));
  if (curves.length === 0) return null;
  const series = curves.map(({ name, style, columns, x }) => ({ name, x, y: columns.nees.map((value) => (value > 0 ? value : NaN)), style }));
  const bounds = curves[0].error.nees_bounds95;
  const drawing = chart({ label: text.nees.title, height: 220, x: wayAxis(curves), y: { name: text.nees.name, unit: { factor: 1, unit: '' }, log: true }, series, limits: bounds.map((value) => ({ value, inView: true })) });
  return section(text.nees, tooled(drawing, text.nees.title), lineLegend(curves.map(({ style, name }) => [style, name])));
}
