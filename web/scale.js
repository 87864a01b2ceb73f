// From values to places, and where to put the ticks.

export function linear([low, high], [from, to]) {
  const slope = high === low ? 0 : (to - from) / (high - low);
  return (value) => from + (value - low) * slope;
}

// About `count` round values in [low, high].
export function ticks(low, high, count = 5) {
  const rough = (high - low) / Math.max(1, count);
  if (!(rough > 0)) return [low];
  const power = 10 ** Math.floor(Math.log10(rough));
  const step = [1, 2, 5, 10].map((digit) => digit * power).find((candidate) => candidate >= rough * 0.999);
  const values = [];
  for (let i = Math.ceil(low / step - 1e-9); i * step <= high + step * 1e-9; ++i) values.push(i * step);
  return values;
}

// Round values on a logarithmic axis: 1, 2 and 5 of each decade, or its power of ten alone, or only some of these.
export function logTicks(low, high, most = 7) {
  if (!(low > 0)) return [];
  const powers = [];
  for (let exponent = Math.floor(Math.log10(low)); exponent <= Math.log10(high); ++exponent) powers.push(exponent);
  const inside = (values) => values.filter((value) => value >= low * 0.999 && value <= high * 1.001);
  const every = Math.ceil(powers.length / most);
  const rare = inside(powers.filter((exponent) => exponent % every === 0).map((exponent) => 10 ** exponent));
  const dense = inside(powers.flatMap((exponent) => [1, 2, 5].map((digit) => digit * 10 ** exponent)));
  return dense.length <= most ? dense : rare;
}

export function logTickText(value) {
  const exponent = Math.log10(value);
  const isPower = Math.abs(exponent - Math.round(exponent)) < 1e-6;
  return isPower ? powerText(Math.round(exponent)) : String(Number(value.toPrecision(1)));
}

export function tickText(value, step) {
  let decimals = Math.min(9, Math.max(0, -Math.floor(Math.log10(step) + 1e-9)));
  if (decimals < 9 && Math.abs(step * 10 ** decimals - Math.round(step * 10 ** decimals)) > 1e-6) decimals += 1; // 2.5
  return (Math.abs(value) < step * 1e-6 ? 0 : value).toFixed(decimals).replace('-', '−');
}

// Whole powers of ten around positive values, at least from `low` to `high`.
export function decades(values, low, high) {
  const positive = values.filter((value) => Number.isFinite(value) && value > 0);
  const least = Math.floor(Math.log10(Math.min(low, ...positive)) + 1e-9);
  const most = Math.ceil(Math.log10(Math.max(high, ...positive)) - 1e-9);
  return [least, Math.max(most, least + 1)];
}

// The place of a value on decades, in per cent; zero and less stand at the left end.
export function percentOnDecades(value, [least, most]) {
  if (!(value > 0)) return 0;
  return Math.min(100, Math.max(0, ((Math.log10(value) - least) / (most - least)) * 100));
}

export function powerText(exponent) {
  if (exponent >= 0 && exponent <= 4) return String(10 ** exponent);
  if (exponent < 0 && exponent >= -3) return (10 ** exponent).toFixed(-exponent);
  const digits = '⁰¹²³⁴⁵⁶⁷⁸⁹';
  const sign = exponent < 0 ? '⁻' : '';
  return '10' + sign + Array.from(String(Math.abs(exponent)), (digit) => digits[digit]).join('');
}
