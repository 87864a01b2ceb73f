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

// Plots that have got a width draw in turn, as many in a frame as it has time for: the first picture waits for no other.
const waiting = new Set();
const share = 12; // ms of a frame

function drawSome() {
  const start = performance.now();
  for (const draw of waiting) {
    waiting.delete(draw);
    draw();
    if (performance.now() - start > share) break;
  }
  if (waiting.size > 0) requestAnimationFrame(drawSome);
  document.documentElement.toggleAttribute('data-drawing', waiting.size > 0);
}

export function soon(draw) {
  if (waiting.size === 0) requestAnimationFrame(drawSome);
  waiting.add(draw);
  document.documentElement.toggleAttribute('data-drawing', true);
}

// What a reader may never scroll to costs nothing: it is drawn when the window comes within half its height of it.
const unseen = new Map();
const watch = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) if (isIntersecting) soon(() => drawNow(target));
}, { rootMargin: '50% 0px' });

function drawNow(node) {
  const draw = unseen.get(node);
  unseen.delete(node);
  watch.unobserve(node);
  draw?.();
}

// Paper shows all of it.
export function drawUnseen() {
  for (const node of unseen.keys()) drawNow(node);
}

export function whenSeen(node, draw) {
  unseen.set(node, draw);
  watch.observe(node);
}

// Before the page is drawn anew.
export function forgetListeners() {
  waiting.clear();
  unseen.clear();
  watch.disconnect();
  for (const list of Object.values(listeners)) list.length = 0;
}
