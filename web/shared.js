// What all plots have in common: the moment under the cursor, the window of time in view, the place to look at.
// Times are seconds since the start of the recording.
const state = { cursor: null, window: null };
const listeners = { cursor: [], window: [], place: [], fit: [] };

export function on(what, listener) {
  listeners[what].push(listener);
}

function tell(what, ...values) {
  for (const listener of listeners[what]) listener(...values);
}

export function cursorTime() {
  return state.cursor;
}

export function setCursor(time, source) {
  if (state.cursor === time) return;
  state.cursor = time;
  tell('cursor', time, source);
}

// null: all of it.
export function timeWindow() {
  return state.window;
}

export function setTimeWindow(window, source) {
  state.window = window;
  tell('window', window, source);
}

// Asks the maps to show a place: {time, points: [{x, y}]}.
export function lookAt(place) {
  setCursor(place.time, null);
  tell('place', place);
}

// All plots draw themselves now, at the width they have: paper does not wait for the next frame.
export function fitAll() {
  tell('fit');
}

// Before the page is drawn anew.
export function forgetListeners() {
  for (const list of Object.values(listeners)) list.length = 0;
}
