// Colours by their role, from the style sheet, so that canvas and CSS agree in light and dark. Those of tracks are told
// apart by eyes that lack a kind of cone, and by their dashes without any colour.
const dashes = { reference: [], nominal: [7, 4], odometry: [2, 3], corrected: [], online: [9, 3, 2, 3], path: [], smoothed: [], localized: [12, 4], result: [], other: [4, 4] };

export function colour(name) {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
}

export function trackStyle(role, result, several) {
  const wide = role === 'reference';
  const name = several && !wide ? `result-${result % 6}` : `track-${role}`;
  return { colour: colour(name), width: wide ? 5 : 1.8, dash: dashes[role] ?? [] };
}
