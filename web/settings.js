// What the reader chose: units and colours. Everything is drawn anew when it changes.
const chosen = { lengths: 'metric', angles: 'degrees', theme: 'auto' };
const listeners = [];
const dark = matchMedia('(prefers-color-scheme: dark)');

export function setting(name) {
  return chosen[name];
}

export function choose(name, value) {
  chosen[name] = value;
  announce();
}

export function onSettings(listener) {
  listeners.push(listener);
}

export function isDark() {
  return chosen.theme === 'dark' || (chosen.theme === 'auto' && dark.matches);
}

function announce() {
  applyTheme(isDark());
  for (const listener of listeners) listener();
}

function applyTheme(toDark) {
  document.documentElement.dataset.theme = toDark ? 'dark' : 'light';
}

applyTheme(isDark());
dark.addEventListener('change', announce);
// Paper is white, and as wide as it is.
addEventListener('beforeprint', () => {
  applyTheme(false);
  document.documentElement.dataset.paper = '';
  for (const listener of listeners) listener();
});
addEventListener('afterprint', () => {
  delete document.documentElement.dataset.paper;
  announce();
});
