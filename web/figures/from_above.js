// All trajectories over each other, with landmarks and slips: of one result, or of several.
import { html, nameOf } from '../dom.js';
import { inUnit, lengthUnit } from '../format.js';
import { map } from '../map.js';
import { trackStyle } from '../palette.js';
import { scrolling, section, table, tooled } from '../section.js';
import { text } from '../strings/en.js';

const mainRoles = ['result', 'smoothed', 'online', 'localized', 'corrected', 'odometry', 'nominal', 'other'];

export function nameOfTrack({ role, name }, result, several) {
  const own = role === 'other' ? name : text.roles[role] ?? name;
  return several ? `${result.label}: ${own}` : own;
}

function mainOf(tracks) {
  return mainRoles.map((role) => tracks.find((track) => track.role === role)).find(Boolean);
}

// Of several robots in one result each has its own colour, as results have.
function styleOf(track, result, index, several) {
  const others = result.tracks.filter(({ role }) => role === 'other');
  if (several || track.role !== 'other' || others.length < 2) return trackStyle(track.role, index, several);
  return trackStyle('result', others.indexOf(track), true);
}

function tracksOf(result, index, several) {
  const main = mainOf(result.tracks);
  const sighted = ['online', 'path', 'localized', 'result'].map((role) => result.tracks.find((track) => track.role === role)).find(Boolean);
  // The reference first, so that it lies below.
  const sorted = [...result.tracks.filter(({ role }) => role === 'reference'), ...result.tracks.filter(({ role }) => role !== 'reference')];
  return sorted.map((track) => {
    const { time_s: time, x_m: x, y_m: y, heading_rad: heading, across95_m: across } = track.columns();
    return { label: nameOfTrack(track, result, several), time, x, y, heading, across, marks: track.marks, style: styleOf(track, result, index, several), isMain: track === main, isSightedFrom: track === sighted, isBare: track.role === 'nominal' && across !== null, poses: track.poses, drawn: track.drawn };
  });
}

function landmarksOf({ map: found }) {
  return (found?.landmarks ?? []).map(({ name, x_m: x, y_m: y, ellipse95: ellipse }) => ({ label: Array.from(name).slice(0, 12).join(''), x, y, ellipse }));
}

// The numbers of the sightings' landmarks in the order of the map's.
function sightingsOf({ sightings, map: found }) {
  if (!sightings || !found) return null;
  const { time_s: time, landmark, decision } = sightings.columns();
  const places = new Map(found.landmarks.map(({ name }, i) => [name, i]));
  const numbers = sightings.landmarks.map((name) => places.get(name) ?? -1);
  return { time, decision, landmark: landmark.map((number) => (Number.isNaN(number) ? -1 : numbers[number])) };
}

function particlesOf({ particles }) {
  if (!particles) return null;
  const { x_m: x, y_m: y, weight } = particles.columns();
  return { x, y, weight };
}

function landmarkTable({ map: found }) {
  if (!found || found.landmarks.length === 0) return null;
  const words = text.map;
  const unit = lengthUnit(found.landmarks.flatMap(({ x_m: x, y_m: y }) => [x, y]));
  const small = lengthUnit([0.001]);
  const columns = [{ head: words.landmark, class: 'first' }, { head: 'x', class: 'number' }, { head: 'y', class: 'number' }, { head: words.semi, class: 'number' }, { head: words.sightings, class: 'number' }];
  const axes = (ellipse) => (ellipse ? `${inUnit(ellipse.semi_major_m, small)} × ${inUnit(ellipse.semi_minor_m, small)}` : '–');
  const rows = found.landmarks.map(({ name, x_m: x, y_m: y, ellipse95, sightings }) => ({ cells: [nameOf(name, 30), inUnit(x, unit, 4), inUnit(y, unit, 4), axes(ellipse95), String(sightings ?? '–')] }));
  return html('details', {}, html('summary', {}, words.landmarkTable), scrolling(table(columns, rows, { class: `cards ${rows.length > 40 ? 'long' : ''}` }), words.landmarkTable));
}

function thinned(tracks) {
  const most = tracks.reduce((worst, track) => (track.poses > worst.poses ? track : worst), tracks[0]);
  return most.drawn < most.poses ? html('p', { class: 'note' }, text.plot.drawn(most.drawn, most.poses)) : null;
}

export function fromAbove(results) {
  const several = results.length > 1;
  const tracks = results.flatMap((result, index) => tracksOf(result, index, several));
  if (tracks.length === 0) return null;
  const slips = several ? [] : (results[0].slip?.events ?? []).map(({ start_s: from, end_s: to }) => ({ from, to }));
  const landmarks = results.flatMap(landmarksOf);
  const drawing = map({ label: text.map.label(tracks.length), tracks, landmarks, particles: several ? null : particlesOf(results[0]), sightings: several ? null : sightingsOf(results[0]), slips });
  const how = [text.map.how, tracks.some(({ isBare }) => isBare) ? text.map.bare : '', landmarks.length > 0 ? text.map.landmarks : '', !several && results[0].particles ? text.map.particles : '', slips.length > 0 ? text.map.slips : ''].filter(Boolean).join(' ');
  return section({ ...text.map, how }, tooled(drawing, text.map.title), thinned(tracks), several ? null : landmarkTable(results[0]));
}
