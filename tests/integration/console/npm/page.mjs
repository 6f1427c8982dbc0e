// The page beside an imitation of the console: page.mjs FULCRUM CHROMIUM FOLDER PAGE, where PAGE is the folder of its files.
import {expect, until} from './console.mjs';
import {Imitation, beats, idle, keysOf, openPage, running, sleep} from './imitation.mjs';

const [, browserPath, , files] = process.argv.slice(2);

/** Runs `use({page, console})` on a fresh page whose console says `state`. */
async function withPage(what, state, use) {
  const console_ = new Imitation();
  console_.state = state;
  console_.answers['/api/choices'] = {scenes: [{name: 'built-in', description: 'd', duration: 20, power: 35, picture_rate: 2}], simulated: true, cart: 'simulated'};
  const {browser, page} = await openPage(browserPath, await console_.start(files));
  const trouble = [];
  page.on('pageerror', error => trouble.push(error.message));
  try {
    await until(page, 10, phase => document.body.dataset.phase === phase, state.phase);
    await use({page, console: console_});
    expect(trouble.length === 0, `no error in the page, but: ${trouble.join('; ')}`);
    console.log(`ok: ${what}`);
  } catch (error) {
    throw new Error(`${what}: ${error.message}`);
  } finally {
    await browser.close();
    console_.end();
  }
}

const showsSession = () => document.body.dataset.phase === 'running' && getComputedStyle(document.getElementById('live')).display !== 'none' &&
  getComputedStyle(document.getElementById('setup')).display === 'none' && document.getElementById('banner').hidden;
const toastSays = text => !document.getElementById('toast').hidden && document.getElementById('toast').textContent === text;

await withPage('after a lost connection the session and the next notice are shown', running({notice: {number: 4, ok: true, text: 'fourth'}}), async ({page, console}) => {
  await until(page, 5, showsSession);
  console.state = running();
  console.silent = true;  // Until the banner was seen, which the next connection hides.
  console.breakStreams();
  await until(page, 2, () => !document.getElementById('banner').hidden && document.body.dataset.phase === 'unknown');
  console.silent = false;
  await until(page, 5, showsSession);
  // A console that was started again counts from 1.
  console.feed(running({notice: {number: 1, ok: false, text: 'restart failed'}}));
  await until(page, 2, toastSays, 'restart failed');
});

await withPage('a silent console is seen', running(), async ({page, console}) => {
  await until(page, 5, showsSession);
  console.silent = true;
  await until(page, 6, () => !document.getElementById('banner').hidden && document.getElementById('status-word').textContent === 'No connection');
  await sleep(1500);  // The next connection gets no response either.
  console.silent = false;
  await until(page, 6, showsSession);
});

await withPage('quick presses of the generator\u2019s knobs all count', running(), async ({page, console}) => {
  // As the console: one command at a time, its answer and the report some tenths of a second later.
  let busy = false, number = 0;
  console.answers['/api/generator'] = fields => {
    if (busy) return {ok: false, text: 'the supervisor has not replied to the last request yet; try again'};
    busy = true;
    setTimeout(() => {
      busy = false;
      console.state = running({figures: {...console.state.figures}, notice: {number: ++number, ok: true, text: 'turned'}});
      setTimeout(() => { for (const [name, power] of fields) console.state.figures[`set_${name}_W`] = Number(power); }, 150);
    }, 200);
    return {ok: true, text: 'sent'};
  };
  await until(page, 5, showsSession);
  for (let press = 0; press < 5; ++press) await page.click('#cut-more');
  await page.click('#coag-less');
  await until(page, 3, () => document.getElementById('set-cut').textContent === '60 W' && document.getElementById('set-coag').textContent === '25 W');
  expect(!(await page.isVisible('#toast.bad')), 'nothing is refused');
  // Up and down at once: the newest counts, whatever the report says meanwhile.
  await page.click('#cut-more');
  await page.click('#cut-less');
  await sleep(2000);
  expect(await page.textContent('#set-cut') === '60 W', `the last press counts, but ${await page.textContent('#set-cut')}`);
  console.answers['/api/generator'] = () => ({ok: false, text: 'no'});
  const before = console.count('/api/generator', 'cut=65');
  await page.click('#cut-more');
  await until(page, 2, toastSays, 'no');
  await sleep(600);
  expect(console.count('/api/generator', 'cut=65') === before + 1, 'a refused press is not repeated');
});

await withPage('a session that fails to start opens no older attempt', idle(), async ({page, console}) => {
  const attempt = session => ({trainee: 'Ann', session, scene: 'line', started: '2026-01-01 00:00:00 UTC', score: 83, well: true});
  const training = attempts => ({person: 'Ann', instructor: false, group: [], attempts,
    courses: [{name: 'Basics', description: 'd', exercises: [{scene: 'line', description: 'Exercise: line', pass: 75, passed: true, scores: [83], cohort: []}]}]});
  console.answers['/api/training'] = training([attempt('20260101-000000-line')]);
  console.answers['/api/attempt'] = {sheet: {}, expert: '', labels: {}};
  console.answers['/api/attempt/events'] = {ready: true, why: '', events: [], left_out: 0};
  const operate = async (state, ended) => {
    await page.click('[data-goto=training]');
    await page.evaluate(() => { document.getElementById('toast').textContent = ''; });
    await page.click('[aria-label="Operate line"]');
    // The page has the answer to its start.
    await until(page, 3, () => document.getElementById('toast').textContent.startsWith('Take the controls'));
    console.feed(state);
    await until(page, 3, () => document.body.dataset.view === 'session');
    console.feed(ended);
    await until(page, 3, () => document.body.dataset.phase === 'idle');
  };
  await operate(idle({phase: 'starting', own: true}), idle({ended: {well: false, text: 'another session runs in domain 0'}}));
  await sleep(500);
  expect(!(await page.isVisible('#attempt-box')), 'the attempt of another session stays closed');
  expect(await page.isVisible('#result-word') && await page.textContent('#result-word') === 'another session runs in domain 0', 'the reason is in view');
  console.answers['/api/training'] = training([attempt('20260101-000100-line'), attempt('20260101-000000-line')]);
  await operate(idle({phase: 'starting', own: true}), idle({session: '20260101-000100-line', ended: {well: true, text: 'All went well.'}}));
  await page.waitForSelector('#attempt-box', {state: 'visible'});
  expect(console.count('/api/attempt') > 0, 'its own attempt opens');
});

/** The page with a live picture and a gamepad without a button pressed. */
async function withHands(what, use) {
  await withPage(what, running(), async ({page, console}) => {
    await until(page, 5, () => !document.getElementById('hands').hidden && !document.getElementById('take').disabled);
    const pad = buttons => page.evaluate(down => {
      window.pads = down && [{connected: true, index: 0, id: 'pad', axes: [0, 0, 0, 0], buttons: Array.from({length: 17}, (_, i) => ({pressed: down.includes(i)}))}] || [null];
    }, buttons);
    await pad([]);
    await beats(page, 2);
    await use({page, console, pad});
  });
}
const take = async page => {
  await page.click('#take');
  await until(page, 2, () => document.body.dataset.controls === 'you');
  await keysOf(page);
};

await withHands('a gamepad that is lost lets everything go', async ({page, pad}) => {
  await take(page);
  await pad([7]);
  await until(page, 2, () => window.sent.includes('down=cut'));
  await pad(null);
  await until(page, 2, () => document.body.dataset.controls === 'none');
  const sent = await keysOf(page);
  expect(sent.includes('up=cut') && sent.includes('release=1'), `the pedal rises, but ${sent}`);
});

await withHands('a trigger that was down before does not press; Start takes and Back releases', async ({page, pad}) => {
  await pad([7]);
  await beats(page, 2);
  await take(page);
  await beats(page, 4);
  expect((await keysOf(page)).length === 0, 'a trigger held while the controls are taken is no pedal');
  await pad([]);
  await beats(page, 2);
  await pad([7]);
  await until(page, 1, () => window.sent.includes('down=cut'));
  await pad([8]);
  await until(page, 1, () => document.body.dataset.controls === 'none');
  await pad([9]);
  await until(page, 1, () => document.body.dataset.controls === 'you');
});

await withHands('a held button rises when the focus leaves it', async ({page}) => {
  await take(page);
  await page.focus('[data-key=cut]');
  await page.keyboard.down('Space');
  await until(page, 1, () => window.sent.includes('down=cut'));
  await page.keyboard.press('Tab');
  await until(page, 1, () => window.sent.includes('up=cut'));
  await page.keyboard.up('Space');
  expect(await page.getAttribute('[data-key=cut]', 'aria-pressed') === 'false', 'Cut is up');
});

await withHands('keys work beside Shift and on keyboards that have digits with Shift only', async ({page}) => {
  await take(page);
  await page.focus('#picture');
  await page.keyboard.down('Shift');
  await page.evaluate(() => { window.sent = []; });
  await page.keyboard.press('Q');
  await until(page, 1, () => window.sent.some(text => /roll=-5/.test(text)));
  await page.keyboard.up('Shift');
  await keysOf(page);
  // The first key of the row of digits of a French keyboard.
  const key = (type, text) => page.evaluate(([kind, value]) => document.getElementById('picture').dispatchEvent(new KeyboardEvent(kind, {key: value, code: 'Digit1', bubbles: true})), [type, text]);
  await key('keydown', '&');
  await key('keyup', '1');
  await key('keydown', '1');
  await key('keyup', '&');
  expect((await keysOf(page)).join() === 'down=tool0,up=tool0,down=tool0,up=tool0', 'each press chooses the tool');
  await page.keyboard.down('ArrowUp');
  await page.keyboard.down('f');
  await page.keyboard.down('Shift');
  await page.keyboard.up('f');
  await page.keyboard.up('ArrowUp');
  await page.keyboard.up('Shift');
  expect((await keysOf(page)).join() === 'down=cut,down=fine,up=cut,up=fine', 'a key rises whatever it would write now');
  await page.evaluate(() => { window.sent = []; });
  await beats(page, 3);
  expect(await page.evaluate(() => window.sent.length > 0 && window.sent.every(text => /x=-?0.00&y=-?0.00/.test(text))), 'the arrow has risen');
});
console.log('the page beside an imitation of the console');
