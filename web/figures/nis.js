// Each sighting's innovation in units of its noise, with the bounds of consistent noise, and what was made of it.
import { chart } from '../chart.js';
import { html } from '../dom.js';
import { significant } from '../format.js';
import { colour } from '../palette.js';
import { legend, scrolling, section, table, tooled } from '../section.js';
import { text } from '../strings/en.js';

function dots({ columns, decisions }) {
  const { time_s: time, nis: values, decision } = columns();
  const of = (name) => {
    const number = decisions.indexOf(name);
    return { name: text.nis.decisions[name], x: time, y: values.map((value, i) => (decision[i] === number && value > 0 ? value : NaN)), dots: true,
      style: { colour: colour(name === 'rejected' ? 'outlier' : 'after'), width: 1, dash: [] } };
  };
  return ['matched', 'rejected'].map(of).filter(({ y }) => y.some((value) => value > 0));
}

export function nis([{ sightings }]) {
  if (!sightings) return null;
  const words = text.nis;
  const series = dots(sightings);
  const drawing = series.length > 0 ? chart({ label: words.title, height: 220, x: { name: text.plot.time, short: text.plot.timeShort, unit: 's', isTime: true }, y: { name: words.name, unit: { factor: 1, unit: '' }, log: true },
    series, limits: sightings.nis_bounds95.map((value) => ({ value, inView: true })) }) : null;
  const counts = Object.entries(sightings.counts).map(([name, number]) => ({ cells: [words.decisions[name] ?? name, String(number)] }));
  return section(words, drawing ? [tooled(drawing, words.title), legend(['dot after', words.decisions.matched], ['dot outlier', words.decisions.rejected])] : null,
    sightings.nis_mean !== null ? html('p', {}, words.mean(significant(sightings.nis_mean, 3), significant(sightings.nis_expected, 2))) : null,
    scrolling(table([{ head: words.counts, class: 'first' }, { head: words.counted, class: 'number' }], counts, { class: 'narrow' }), words.counts));
}
