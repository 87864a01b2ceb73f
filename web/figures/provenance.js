// From what and how this was made.
import { html } from '../dom.js';
import { scrolling, section, table } from '../section.js';

function textOf(value) {
  return typeof value === 'string' ? value : JSON.stringify(value);
}

function facts(provenance) {
  const { program, version, seed, options = {} } = provenance;
  const entries = [['program', [program, version].filter(Boolean).map(textOf).join(' ')]];
  if (seed !== undefined && seed !== null) entries.push(['seed', textOf(seed)]);
  for (const [key, value] of Object.entries(options ?? {})) entries.push([key, textOf(value)]);
  return html('dl', {}, entries.map(([key, value]) => [html('dt', {}, key), html('dd', {}, value)]));
}

export function provenance(document) {
  const found = document.provenance;
  if (!found || Object.keys(found).length === 0) return null;
  const inputs = Array.isArray(found.inputs) ? found.inputs : [];
  const rows = inputs.map((input) => ({ cells: [html('span', { class: 'path' }, textOf(input.path ?? '')), html('code', {}, textOf(input.sha256 ?? ''))] }));
  return section('Where this comes from', 'Provenance',
    'The same program version, inputs and options give the same bytes again; the SHA-256 shows whether an input is still the same.',
    facts(found), rows.length > 0 ? scrolling(table([{ head: 'Input', class: 'first' }, { head: 'SHA-256' }], rows, { class: 'inputs' }), 'Inputs') : null);
}
