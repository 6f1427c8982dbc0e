'use strict';
// The operator's page. It receives the state as a stream of JSON objects (fields: services/session/console/DESIGN.md) and
// sends a POST for each button. Elements change only where the state has changed, so that no button moves under a finger.

const $ = id => document.getElementById(id);
const kSpan = 60;
const kMarks = {good: '●', busy: '▲', bad: '■', off: '○'};

let token = location.hash.slice(1) || sessionStorage.getItem('token') || '';
if (location.hash) {
  sessionStorage.setItem('token', token);
  history.replaceState(null, '', location.pathname);  // The token does not stay in the address line.
}

function setText(element, text) { if (element.textContent !== text) element.textContent = text; }
function make(tag, className, text) {
  const element = document.createElement(tag);
  if (className) element.className = className;
  if (text !== undefined) element.textContent = text;
  return element;
}

// ------------------------------------------------------------------------------------------------ requests

async function call(path, fields, signal) {
  const options = {headers: {Authorization: `Bearer ${token}`}, signal};
  if (fields) {
    options.method = 'POST';
    options.body = new URLSearchParams(fields);
  }
  const response = await fetch(path, options);
  if (response.status === 401) askToken();
  return response;
}

/** For buttons: sends a request and shows the reply when it is a refusal, or `well` when the request succeeded. */
async function order(path, fields, well) {
  try {
    const answer = await (await call(path, fields || {})).json();
    if (!answer.ok) toast(answer.text, true); else if (well) toast(well);
    return answer.ok ? answer : null;
  } catch (error) {
    toast('No response from the console.', true);
    return null;
  }
}

/** Opens a WebSocket of the console. Throws with the reason of a refusal. */
async function openSocket(path) {
  const answer = await call('/api/ticket', {}).then(r => r.json());
  if (!answer.ok) throw new Error(answer.text);
  const socket = new WebSocket(`${location.origin.replace(/^http/, 'ws')}${path}?ticket=${answer.text}`);
  socket.binaryType = 'arraybuffer';
  return socket;
}

let toastTimer = 0;
function toast(text, bad) {
  $('toast').textContent = text;
  $('toast').className = bad ? 'bad' : '';
  $('toast').hidden = false;
  clearTimeout(toastTimer);
  toastTimer = setTimeout(() => { $('toast').hidden = true; }, bad ? 9000 : 3500);
}

function askToken() { if (!$('ask-token').open) $('ask-token').showModal(); }
$('token-form').addEventListener('submit', () => {
  token = $('token').value.trim().replace(/^.*#/, '');
  sessionStorage.setItem('token', token);
  location.reload();
});

const kSilence = 3000;  // ms: the console sends five states a second.
let points = [];
async function listen() {
  for (;;) {
    // A network that is gone does not end a connection by itself.
    const gone = new AbortController();
    let silence = 0, why = 'No response from the console. If this message stays, start it again: fulcrum console';
    const heard = () => {
      clearTimeout(silence);
      silence = setTimeout(() => gone.abort(), kSilence);
    };
    try {
      heard();
      const response = await call('/api/events', undefined, gone.signal);
      if (response.status === 401) return;
      if (!response.ok) {
        why = (await response.json().catch(() => ({}))).text || why;
        throw new Error(why);
      }
      $('banner').hidden = true;
      points = [];
      const reader = response.body.pipeThrough(new TextDecoderStream()).getReader();
      for (let text = '';;) {
        const {value, done} = await reader.read();
        if (done) break;
        heard();
        text += value;
        const parts = text.split('\n\n');
        text = parts.pop();
        // Of several states only the last is shown; the plot points of all are kept.
        const states = parts.map(part => JSON.parse(part.replace(/^data: /, '')));
        for (const state of states) takePoints(state);
        if (states.length) show(states[states.length - 1]);
      }
    } catch (error) { /* The banner below reports it. */ } finally {
      clearTimeout(silence);
      gone.abort();
    }
    $('banner').textContent = why;
    $('banner').hidden = false;
    document.body.dataset.phase = 'unknown';
    // The next connection starts from nothing: perhaps to another console, which counts its notices from 1.
    state = {phase: 'unknown'};
    noticed = -1;
    setStatus('off', 'No connection', '');
    await new Promise(done => setTimeout(done, 1000));
  }
}

// ------------------------------------------------------------------------------------------------ the session

let state = {phase: 'unknown'};
let noticed = -1;

function takePoints(s) {
  for (const p of s.points) {
    if (points.length && p[0] < points[points.length - 1][0]) points = [];  // A new session has begun.
    points.push(p);
  }
  while (points.length && points[0][0] < points[points.length - 1][0] - kSpan) points.shift();
}

function setStatus(level, word, more) {
  $('status-word').className = `level-${level}`;
  setText($('status-word'), word);
  setText($('status-more'), more);
}

function show(s) {
  const before = state;
  state = s;
  if (s.phase !== before.phase) enterPhase(before.phase);
  showStatus();
  $('stop').disabled = s.phase !== 'running' && s.phase !== 'starting';
  if (s.phase !== 'idle') {
    showNodes(s.nodes || []);
    showFigures(s.figures);
    showPicture();
  }
  live.show(s);
  training.at(s.person_changes);
  showWarnings(s.warnings || []);
  showTask(s.task);
  if (s.notice && s.notice.number > noticed) {
    if (noticed >= 0) toast(s.notice.text, !s.notice.ok);
    noticed = s.notice.number;
  }
  if (noticed < 0) noticed = 0;
  showEnd(before);
}

function enterPhase(before) {
  document.body.dataset.phase = state.phase;
  if (state.phase === 'starting') {
    points = [];
    clearPicture();
  }
  if (state.phase === 'starting' && before !== 'unknown') goTo('session');
  if (state.phase === 'idle') loadChoices();
}

function showStatus() {
  const s = state;
  const worst = (s.nodes || []).some(n => n.level === 'bad') ? 'bad' : (s.nodes || []).some(n => n.level === 'busy') ? 'busy' : 'good';
  const clock = s.time === undefined ? '' : `${Math.max(0, s.time).toFixed(0)}${s.end > 0 ? ` / ${s.end.toFixed(0)}` : ''} s`;
  if (s.phase === 'running') setStatus(worst, worst === 'bad' ? 'Trouble' : 'Running', `${clock} · ${s.scene}${s.recording ? ' · rec' : ''}`);
  else if (s.phase === 'starting') setStatus('off', 'Starting', s.said || '');
  else if (s.phase === 'stopping') setStatus('off', 'Ending', 'the report is being written');
  else setStatus('good', 'Ready', '');
}

const rows = new Map();
function makeRow(node) {
  const row = make('li');
  const parts = {row, mark: make('span', 'mark'), name: make('span', 'name', node.label), word: make('span', 'word'), more: make('span', 'more'),
    button: make('button', '', 'Restart')};
  parts.mark.setAttribute('aria-hidden', 'true');
  parts.button.type = 'button';
  parts.button.setAttribute('aria-label', `Restart ${node.label}`);
  parts.button.addEventListener('click', () => order('/api/restart', {node: node.name}));
  row.dataset.node = node.name;
  row.append(parts.mark, parts.name, parts.word, parts.button, parts.more);
  $('nodes').append(row);
  return parts;
}
function showNodes(nodes) {
  for (const [name, parts] of rows) {
    if (!nodes.some(n => n.name === name)) { parts.row.remove(); rows.delete(name); }
  }
  for (const node of nodes) {
    if (!rows.has(node.name)) rows.set(node.name, makeRow(node));
    const parts = rows.get(node.name);
    setText(parts.mark, kMarks[node.level]);
    parts.mark.className = `mark level-${node.level}`;
    setText(parts.word, node.word);
    parts.word.className = `word level-${node.level}`;
    const ms = v => v < 0.1 ? v.toFixed(2) : v < 10 ? v.toFixed(1) : v.toFixed(0);
    const more = [`${node.rate.toFixed(0)} Hz`, `step ${ms(node.p99)} ms`];
    if (node.input) more.push(`age ${node.age} ms`);
    setText(parts.name, node.label + (node.restarts ? ` ↻${node.restarts}` : ''));
    setText(parts.more, node.pid ? more.join(' · ') : 'no data yet');
    parts.row.title = `${node.name}: requested rate ${node.asked} Hz; 99 % of the steps were shorter than the time shown, the median is ${ms(node.p50)} ms; age is that of the newest ${node.input || 'input'} when it was used; ` +
      `${node.restarts} restarts, ${node.drops} samples lost or refused, ${node.overruns} periods skipped, pid ${node.pid}`;
    parts.button.disabled = state.phase !== 'running';
  }
}

let warned = '';
function showWarnings(warnings) {
  if (state.phase === 'idle') warnings = [];
  const key = JSON.stringify(warnings);
  if (key === warned) return;
  warned = key;
  $('warning-list').replaceChildren(...warnings.map(w => {
    const item = make('li', w.level);
    item.append(make('b', '', w.text), w.todo);
    return item;
  }));
  if (!warnings.length) $('warning-list').append(make('li', 'none', 'None'));
}

function showFigures(figures) {
  generator.show(figures, state.notice);
  if (!figures) return;
  const heat = figures.temperature_C !== undefined;  // Scenes without heat have no temperature.
  setText($('temperature'), heat ? `${figures.temperature_C.toFixed(0)} °C` : '–');
  setText($('temperature-more'), heat ? `${figures.power_W.toFixed(0)} W · cut ${figures.cut_mm.toFixed(1)} mm` : 'no heat in this scene');
  const forces = Object.keys(figures).filter(key => /^force\d_N$/.test(key)).map(key => figures[key]);
  setText($('force'), `${Math.max(0, ...forces).toFixed(2)} N`);
  setText($('force-more'), `highest ${figures.peak_force_N.toFixed(2)} N · at the hand ${figures.hand_force_N.toFixed(2)} N`);
  drawPlot($('plot-temperature'), points, {span: kSpan, floor: 20, least: 60, unit: '°C', lines: heat ? [{at: 1, colour: '#ff8a5c'}] : []});
  drawPlot($('plot-force'), points, {span: kSpan, floor: 0, least: 0.5, unit: 'N',
    lines: ['#58bcff', '#ffd866', '#5ce0a8', '#d9a8ff'].map((colour, i) => ({at: 2 + i, colour})).filter(({at}) => at < 4 || points.some(p => p[at] > 0))});
}

let pictureShown = '', pictureAsked = false;
function clearPicture() {
  pictureShown = '';
  const g = $('picture').getContext('2d');
  g.clearRect(0, 0, $('picture').width, $('picture').height);
}
/** Draws a picture's file in a canvas, at its own size, unless it is out of date when it has been decoded. */
async function drawPicture(file, canvas = $('picture'), isOld = () => false) {
  const image = await createImageBitmap(file);
  if (isOld()) return image.close();
  if (canvas.width !== image.width || canvas.height !== image.height) {
    canvas.width = image.width;
    canvas.height = image.height;
  }
  canvas.getContext('2d').drawImage(image, 0, 0);
  image.close();
}
async function showPicture() {
  const said = pictureShown || live.shows() ? '' : state.phase === 'starting' ? (state.said || 'The nodes are starting.')
    : state.own || state.picture ? 'Waiting for the first picture.' : 'The pictures of this session are in another folder, because it was not started here.';
  setText($('scope-text'), said);
  if (live.shows()) return;  // Live pictures come by themselves.
  const name = `${state.session}/${state.picture}`;
  if (!state.picture || pictureAsked || name === pictureShown) return;
  pictureAsked = true;
  try {
    const response = await call(`/api/picture?name=${state.picture}`);
    if (response.ok) {
      await drawPicture(await response.blob());
      pictureShown = name;
      $('picture').dataset.shown = name;
    }
  } catch (error) { /* The next picture replaces it. */ }
  pictureAsked = false;
}

// ------------------------------------------------------------------------------------------------ before and after

let choices = null, power = 0;
async function loadChoices() {
  const answer = await call('/api/choices').then(r => r.ok ? r.json() : null).catch(() => null);
  // The choices made before a session are kept after it.
  if (!answer || JSON.stringify(answer) === JSON.stringify(choices)) return;
  const chosen = choices ? $('start-form').scene.value : 'built-in';
  choices = answer;
  setText($('cart-name'), choices.simulated ? 'Simulated' : choices.cart);
  setText($('cart-more'), choices.simulated ? 'Handles, pedal and devices are simulated: the scene\u2019s script moves them.'
    : 'Hardware that its cart file does not name is simulated.');
  $('scenes').replaceChildren(...choices.scenes.map(scene => chip('scene', scene.name, scene.name, scene.description)));
  const first = choices.scenes.find(s => s.name === chosen) || choices.scenes[0];
  if (first) {
    for (const input of $('scenes').querySelectorAll('input')) input.checked = input.value === first.name;
    chooseScene();
  }
  $('start').disabled = !first;
}
function chip(name, value, text, more) {
  const label = make('label'), input = make('input'), span = make('span', '', text);
  Object.assign(input, {type: 'radio', name, value});
  if (more) span.append(make('small', '', more));
  label.append(input, span);
  return label;
}
function sceneChosen() { return choices && choices.scenes.find(s => s.name === $('start-form').scene.value); }
function chooseScene() {
  const scene = sceneChosen();
  if (!scene) return;
  power = scene.power;
  showPower();
  const chips = (id, name, values) => {
    $(id).replaceChildren(...values.map(([value, text]) => chip(name, value, text)));
    $(id).querySelector('input').checked = true;
  };
  chips('lengths', 'seconds', [['', scene.duration > 0 ? `As the scene: ${scene.duration} s` : 'Until stopped'],
    ['60', '1 min'], ['300', '5 min'], ['1800', '30 min'], ['28800', '8 h']]);
  showRecord();
  chips('rates', 'picture_rate', [['', `${scene.picture_rate}`], ...[5, 10].filter(r => r !== scene.picture_rate).map(r => [`${r}`, `${r}`])]);
}
// A recording of built-in; smaller scenes need less.
const kRecordMB = 22.5;
let recordChosen = false;
function showRecord() {
  const form = $('start-form'), scene = sceneChosen();
  if (!scene) return;
  const seconds = Number(form.seconds.value) || (form.hands.value === 'on' ? 0 : scene.duration);
  // Without a choice long sessions keep their last seconds only: a full disk would end the recording anyway.
  if (!recordChosen) form.record.value = seconds > 600 ? 'off' : 'on';
  const size = gigabytes => gigabytes < 10 ? `${gigabytes.toFixed(1)} GB` : `${Math.round(gigabytes)} GB`;
  setText($('record-hint'), form.record.value === 'off' ? 'The last 30 s are kept when a node fails, or on request.'
    : seconds > 0 ? `Up to ${size(1e-3 * kRecordMB * seconds)}.` : `Up to ${size(3.6 * kRecordMB)} an hour.`);
}
$('start-form').addEventListener('change', event => {
  if (event.target.name === 'record') recordChosen = true;
  showRecord();
});
function showPower() {
  $('power').textContent = power > 0 ? `${power} W` : 'none';
  $('power-less').disabled = power <= 5;
  $('power-more').disabled = power <= 0 || power >= 120;
}
for (const [id, step] of [['power-less', -5], ['power-more', 5]]) {
  $(id).addEventListener('click', () => {
    power = Math.min(120, Math.max(5, power + step));
    showPower();
  });
}
$('scenes').addEventListener('change', chooseScene);

$('start-form').addEventListener('submit', event => {
  event.preventDefault();
  const form = $('start-form'), scene = sceneChosen();
  if (!scene) return;
  const fields = {scene: scene.name, record: form.record.value, hands: form.hands.value};
  if (power !== scene.power) fields.power = power;
  for (const name of ['seconds', 'picture_rate']) if (form[name].value) fields[name] = form[name].value;
  order('/api/start', fields);
});

let ended = '';
async function showEnd(before) {
  const key = `${state.session} ${state.has_report} ${state.ended ? state.ended.text : ''}`;
  if (state.phase !== 'idle' || key === ended) return;
  ended = key;
  if (state.ended) training.ended(state.session);
  $('result').hidden = !state.ended && !state.has_report;
  $('report').hidden = $('questionnaire').hidden = !state.has_report;
  const word = $('result-word');
  word.className = !state.ended ? 'level-off' : state.ended.well ? 'level-good' : 'level-bad';
  setText(word, state.ended ? state.ended.text : state.session);
  $('result-figures').replaceChildren();
  if (!state.has_report) return;
  const f = await call('/api/summary').then(r => r.ok ? r.json() : null).catch(() => null);
  if (!f) return;
  if (!state.ended) {
    word.className = f.ok ? 'level-good' : 'level-bad';
    setText(word, f.ok ? 'All went well.' : f.verdict);
  }
  const figure = (label, value, digits, unit) => value === undefined ? [] : [make('dt', '', label), make('dd', '', `${value.toFixed(digits)}${unit}`)];
  $('result-figures').replaceChildren(make('dt', '', 'Scene'), make('dd', '', f.scene), ...figure('Time', f.session_seconds, 1, ' s'),
    ...figure('Highest force', f.peak_force_N, 2, ' N'), ...figure('Hottest tissue', f.highest_temperature_C, 0, ' °C'),
    ...figure('Cut', f.cut_length_mm, 1, ' mm'), ...figure('Warnings of heat', f.warnings, 0, ''), ...figure('Injuries', f.injuries, 0, ''),
    ...figure('Restarts of nodes', f.restarts, 0, ''));
}

$('stop').addEventListener('click', () => $('ask-stop').showModal());
$('stop-no').addEventListener('click', () => $('ask-stop').close());
$('stop-yes').addEventListener('click', () => {
  $('ask-stop').close();
  order('/api/stop');
});
$('dump').addEventListener('click', () => order('/api/dump'));
$('report').addEventListener('click', async () => {
  const answer = await order('/api/ticket');
  if (!answer) return;
  $('report-frame').src = `/report?ticket=${answer.text}`;
  $('report-box').showModal();
});
$('report-close').addEventListener('click', () => {
  $('report-box').close();
  $('report-frame').removeAttribute('src');
});

// ------------------------------------------------------------------------------------------------ other views

function goTo(view) {
  document.body.dataset.view = view;
  for (const button of document.querySelectorAll('nav button')) {
    if (button.dataset.goto === view) button.setAttribute('aria-current', 'page'); else button.removeAttribute('aria-current');
  }
  if (view === 'recordings') loadRecordings();
  if (view === 'training') training.load();
}
for (const button of document.querySelectorAll('nav button')) button.addEventListener('click', () => goTo(button.dataset.goto));

let recordings = '';
async function loadRecordings() {
  const answer = await call('/api/recordings').then(r => r.json()).catch(() => ({recordings: []}));
  if (JSON.stringify(answer) === recordings) return;
  recordings = JSON.stringify(answer);
  $('recordings').replaceChildren(...answer.recordings.map(recording => {
    const item = make('li'), what = make('span', 'what'), button = make('button', '', 'Replay');
    const [session, file] = recording.name.split('/');
    const at = session.match(/^(\d{4})(\d\d)(\d\d)-(\d\d)(\d\d)(\d\d)-(.*)$/);
    what.textContent = at ? `${at[7]}, ${at[1]}-${at[2]}-${at[3]} ${at[4]}:${at[5]}:${at[6]} UTC` : session;
    const dump = file.startsWith('dump') ? 'the last seconds, kept when a node failed or on request, ' : '';
    what.append(make('small', '', `${file}, ${dump}${(recording.bytes / 1e6).toFixed(1)} MB`));
    button.type = 'button';
    button.setAttribute('aria-label', `Replay ${recording.name}`);
    button.addEventListener('click', () => order('/api/replay', {name: recording.name}));
    item.append(what, button);
    return item;
  }));
  if (!answer.recordings.length) $('recordings').append(make('li', '', 'None yet: run a session with Record on.'));
}

for (const button of document.querySelectorAll('.cards button')) {
  button.addEventListener('click', () => order('/api/calibrate', {what: button.dataset.what, tool: button.dataset.tool}));
}

let taskText = '';
function showTask(task) {
  const hidden = !task;
  if ($('task').hidden !== hidden) {
    $('task').hidden = hidden;
    if (!hidden) $('task-enter').focus();
  }
  if (hidden) return;
  setText($('task-title'), task.title);
  if (task.text !== taskText) {
    taskText = task.text;
    $('task-text').textContent = task.text;
    $('task-text').scrollTop = $('task-text').scrollHeight;
  }
  $('task-enter').disabled = !task.wants_enter;
  $('task-enter').hidden = !task.running;
  $('task-cancel').hidden = !task.running;
  $('task-close').hidden = task.running;
  $('task-end').className = task.running ? '' : task.cancelled ? 'level-off' : task.ok ? 'level-good' : 'level-bad';
  setText($('task-end'), task.running ? '' : task.cancelled ? 'Cancelled.' : task.ok ? 'Done.' : `It ${task.end}.`);
}
$('task-enter').addEventListener('click', () => order('/api/task/enter'));
$('task-cancel').addEventListener('click', () => order('/api/task/cancel'));
$('task-close').addEventListener('click', () => {
  $('task').hidden = true;
  order('/api/task/close');
});

window.addEventListener('resize', () => showFigures(state.figures));
document.addEventListener('DOMContentLoaded', () => { if (token) listen(); else askToken(); });
