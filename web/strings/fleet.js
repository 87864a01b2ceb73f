// What the fleet page says.
const number = (value) => value.toLocaleString('en').replaceAll(',', ' ');
const count = (value, one, many) => `${number(value)} ${value === 1 ? one : many}`;

export const words = {
  title: (robots, logs, failed) => `${count(robots, 'robot', 'robots')}, ${count(logs, 'log', 'logs')}${failed ? `, ${number(failed)} of them failed` : ''}`,
  attention: (robots) => (robots ? `${count(robots, 'robot needs', 'robots need')} attention` : 'No robot needs attention'),
  from: (first, last, version) => `${first ? `From ${first} to ${last}. ` : ''}Made with trundle ${version}.`,
  reasons: { change: 'changed', outlier: 'outlying robot', run: 'outlying run', failed: 'failed log', warning: 'warnings', run_needed: 'run needed' },
  search: 'Robot', type: 'Type', allTypes: 'all types', only: 'Attention', everything: 'all robots', anyReason: 'any reason',
  shown: (shown, all) => (shown === all ? count(all, 'robot', 'robots') : `${number(shown)} of ${count(all, 'robot', 'robots')}`),
  columns: { name: 'Robot', report: 'Report', type: 'Type', attention: 'Attention', runs: 'Runs', last: 'Last run', rms: 'Position error', slip: 'Slip' },
  report: 'own report',
  help: { rms: 'rms of the last run with a reference, calibrated, start-aligned [mm]', slip: 'share of intervals that slip, last run', attention: 'why it stands out; sorted by how many reasons',
    parameter: (name, unit) => `${name}, ${unit}: the robot’s value given all robots of its type; in colour where the robot is outlying` },
  multiples: 'Parameters of the fleet',
  multiplesHow: (rate) => `Each picture has all robots of the type; dark: those in the table above. The line is the mean of the population, the band two spreads. Of the robots and runs named as outlying at most ${rate} are named wrongly in the mean.`,
  population: (mean, interval, spread, spreadInterval) => `mean ${mean} (95 %: ${interval}), spread ${spread} (${spreadInterval})`,
  noPopulation: 'fewer than three robots: no population',
  robot: { close: 'Close', parameter: 'Parameter', value: 'Value', interval: '95 %', population: 'In the population', change: 'Changes', needs: 'Next run',
    runs: 'Runs by date', z: (z) => `${z} σ`, unobservable: 'unobservable in its runs', date: 'Date', log: 'Log', status: 'Status', findings: 'Warnings', line: 'Remark', none: 'none' },
  label: (name, robots) => `Histogram of ${name} of ${count(robots, 'robot', 'robots')}`,
  series: (name) => `${name} by run, with its 95 % interval`,
};
