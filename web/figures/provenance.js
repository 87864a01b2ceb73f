// From what and how this was made.
import { html } from '../dom.js';
import { scrolling, section, table } from '../section.js';
import { text } from '../strings/en.js';

function textOf(value) {
  return typeof value === 'string' ? value : JSON.stringify(value);
}

function facts({ program, version, seed, options = {} }) {
  const entries = [[text.provenance.program, [program, version].filter(Boolean).map(textOf).join(' ')]];
  if (seed !== undefined && seed !== null) entries.push([text.provenance.seed, textOf(seed)]);
  for (const [key, value] of Object.entries(options ?? {})) entries.push([key, textOf(value)]);
  return html('dl', {}, entries.map(([key, value]) => [html('dt', {}, key), html('dd', {}, value)]));
}

function hashes(list, head) {
  if (list.length === 0) return null;
  const rows = list.map((input) => ({ cells: [html('span', { class: 'path' }, textOf(input.path ?? '')), html('code', {}, textOf(input.sha256 ?? ''))] }));
  return html('details', { open: list.length <= 8 }, html('summary', {}, `${head} (${list.length})`), scrolling(table([{ head, class: 'first' }, { head: 'SHA-256' }], rows, { class: 'inputs' }), head));
}

// What the heads of the files say, each said once.
function made(sources) {
  const lines = [...new Set(sources.flatMap(({ made_by: list }) => list))];
  return lines.length === 0 ? null : html('details', {}, html('summary', {}, text.provenance.made), html('pre', {}, lines.join('\n')));
}

export function provenance([{ calibration, run, sources }]) {
  const found = run?.program ? run : calibration?.provenance ?? {};
  if (Object.keys(found).length === 0 && sources.length === 0) return null;
  return section(text.provenance, found.program ? facts(found) : null, hashes(Array.isArray(found.inputs) ? found.inputs : [], text.provenance.input), hashes(sources, text.provenance.file), made(sources));
}
