// The way of a trainee by the keyboard alone, and by touch alone on a phone, from the view Training to the replay of an
// attempt; contrast and layout of what is seen on the way: access.mjs FULCRUM CHROMIUM FOLDER. Leaves screenshots in FOLDER.
import {execFileSync} from 'node:child_process';
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {allRun, drawn, expect, look, sizes, until, withConsole} from './console.mjs';
import {focusOf} from './contrast.mjs';

const [fulcrum, browser, folder] = process.argv.slice(2);
const state = mkdtempSync(join(tmpdir(), 'fulcrum-access-'));
process.env.XDG_STATE_HOME = state;
const kDomain = 67, kScene = 'coagulate', kNodes = 6;

/** Presses Tab until `name` has the focus. On the way the focus is seen, and never jumps back up. */
async function tabTo(page, name, key = 'Tab') {
  const way = [];
  for (let before = null; way.length < 90;) {
    await page.keyboard.press(key);
    const now = await page.evaluate(focusOf);
    if (now) {
      expect(now.visible && now.inside && now.outline >= 2, `the focus is seen, but of ${now.name}: ${JSON.stringify(now)}`);
      const back = before && (key === 'Tab' ? now.bottom <= before.top && now.left <= before.left : now.top >= before.bottom && now.left >= before.left);
      expect(!back, `the focus goes through the page in one direction, but from ${before && before.name} to ${now.name}`);
      if (now.name === name) return;
    }
    way.push(now ? now.name : '(none)');
    before = now;
  }
  throw new Error(`${key} does not reach ${name}, but ${way.join(', ')}`);
}
const focused = page => page.evaluate(() => document.activeElement.id || document.activeElement.getAttribute('aria-label') || document.activeElement.tagName);
const scrubTime = page => page.evaluate(() => Number(document.getElementById('scrub').value));
const rest = ms => new Promise(done => setTimeout(done, ms));
const shown = side => document.querySelectorAll(`#${side}-events button`).length > 0;
const idle = () => document.body.dataset.phase === 'idle';

async function byKeyboard({address, newPage}) {
  const page = await newPage(sizes[0]);
  const {keyboard} = page;
  await page.goto(address);
  await page.waitForSelector('#scenes label');
  await tabTo(page, 'Training');
  await keyboard.press('Enter');
  await page.waitForSelector('#courses li');
  await look(page, 'training-nobody', folder);

  // An instructor sees the table of all, and a trainee what others scored, without their names.
  await tabTo(page, 'person_name');
  await keyboard.type('I. Instructor');
  await tabTo(page, 'pin');
  await keyboard.type('1357');
  await tabTo(page, 'instructor');
  await keyboard.press('Space');
  await tabTo(page, 'new-trainee', 'Shift+Tab');
  await keyboard.press('Enter');
  await until(page, 5, () => document.querySelectorAll('#group-rows tr').length === 3);
  expect((await page.textContent('#group-rows')).includes('Berthold'), 'the instructor sees who it was');
  await look(page, 'training-group', folder);
  await tabTo(page, 'leave');
  await keyboard.press('Enter');
  await until(page, 5, () => document.getElementById('person').textContent.startsWith('Nobody'));
  await tabTo(page, 'person_name');
  await keyboard.type('A. Trainee');
  await tabTo(page, 'pin');
  await keyboard.type('2468');
  await tabTo(page, 'new-trainee');
  await keyboard.press('Enter');
  await until(page, 5, () => document.getElementById('person').textContent === 'A. Trainee');
  expect(await focused(page) === 'training-title', 'the keyboard goes on where the form was');
  expect(await page.isHidden('#group'), 'the table is the instructor\'s');

  await tabTo(page, `Demonstration of ${kScene}`);
  await keyboard.press('Enter');
  await until(page, 60, allRun, kNodes);
  await until(page, 60, idle);
  await until(page, 10, () => !document.getElementById('result').hidden);

  // The view's content comes late, while the keyboard is in it already, and does not take its place.
  await page.route('**/api/training', async route => {
    await rest(500);
    await route.continue();
  });
  await tabTo(page, 'Training');
  await keyboard.press('Enter');
  await tabTo(page, 'Demonstration of camera');
  await page.waitForResponse('**/api/training');
  await rest(100);
  expect(await focused(page) === 'Demonstration of camera', `a late answer keeps the focus, but ${await focused(page)}`);
  await tabTo(page, `Operate ${kScene}`);
  await keyboard.press('Enter');
  await until(page, 60, allRun, kNodes);
  await until(page, 20, drawn);
  await until(page, 20, () => document.activeElement.id === 'take');
  await keyboard.press('Enter');
  await until(page, 5, () => document.body.dataset.controls === 'you');
  for (const key of ['PageDown', 'f']) {
    await keyboard.down(key);
    await rest(800);
    await keyboard.up(key);
  }
  await look(page, 'operating', folder);
  await keyboard.press('Escape');
  await until(page, 5, () => document.body.dataset.controls === 'none');
  await tabTo(page, 'stop', 'Shift+Tab');
  await keyboard.press('Enter');
  await look(page, 'ask-stop', folder);
  await tabTo(page, 'stop-yes');
  await keyboard.press('Enter');

  await page.waitForSelector('#attempt-box[open]');
  await until(page, 20, shown, 'own');
  await until(page, 20, shown, 'expert');
  await until(page, 20, () => document.getElementById('film-own').dataset.time && document.getElementById('film-expert').dataset.time);
  await look(page, 'attempt', folder);
  expect((await page.textContent('#own-events')).includes('Pedal cut'), 'the pedal is on the time line');
  for (const what of ['Pedal coag', 'Hook (tool 2) touches', 'Blanching']) expect((await page.textContent('#expert-events')).includes(what), `${what} is among the events of the demonstration`);
  expect(await page.locator('#own-lane .sign').count() === await page.locator('#own-events button').count(), 'a mark for each event');
  await tabTo(page, 'scrub');
  await keyboard.press('ArrowRight');
  expect(await scrubTime(page) > 0, 'the arrow moves the time');
  await page.keyboard.press('Tab');
  const jump = await page.evaluate(() => document.activeElement.textContent);
  expect(/^\d/.test(jump), `the events follow the slider, but ${jump}`);
  await tabTo(page, await page.evaluate(() => [...document.querySelectorAll('#own-events button')].find(b => b.textContent.includes('Pedal cut')).textContent.trim()));
  await keyboard.press('Enter');
  const at = parseFloat(await page.evaluate(() => document.activeElement.textContent));
  expect(Math.abs(await scrubTime(page) - at) <= 0.06, `Enter jumps to the event at ${at} s, but to ${await scrubTime(page)} s`);
  expect(await page.evaluate(() => document.activeElement.getAttribute('aria-current')) === 'time', 'the event of the present time is marked');
  await tabTo(page, 'play', 'Shift+Tab');
  await keyboard.press('Enter');
  await until(page, 5, from => Number(document.getElementById('scrub').value) > from, at);
  await keyboard.press('Escape');
  await until(page, 5, () => document.activeElement.dataset.session);

  // The trend: one attempt of one's own, three of others.
  const trend = await page.evaluate(() => document.querySelector('button.trend').getAttribute('aria-label'));
  expect(trend.startsWith(`Scores of ${kScene}`) && trend.endsWith('and those of others'), `the trend has the others, but: ${trend}`);
  await tabTo(page, trend, 'Shift+Tab');
  await keyboard.press('Enter');
  await page.waitForSelector('#trend-box[open]');
  await look(page, 'trend', folder);
  expect(/3 people/.test(await page.textContent('#trend-rows')), 'three others in the table');
  expect(!/Berthold|Cyprian|Dietrich/.test(await page.textContent('body')), 'no other trainee has a name here');
  await keyboard.press('Escape');
  await page.context().close();
}

/** Touches of a finger or two, which go from the first to the last place. */
async function touch(page, ways) {
  const session = await page.context().newCDPSession(page), steps = 12;
  const at = i => ways.map(([from, to], id) => ({x: from[0] + (to[0] - from[0]) * i / steps, y: from[1] + (to[1] - from[1]) * i / steps, id}));
  await session.send('Input.dispatchTouchEvent', {type: 'touchStart', touchPoints: at(0)});
  for (let i = 1; i <= steps; ++i) {
    await session.send('Input.dispatchTouchEvent', {type: 'touchMove', touchPoints: at(i)});
    await rest(40);
  }
  await session.send('Input.dispatchTouchEvent', {type: 'touchEnd', touchPoints: []});
  await session.detach();
}

async function byTouch({address, newPage}) {
  const page = await newPage(sizes[2], {hasTouch: true, isMobile: true});
  await page.goto(address);
  await page.waitForSelector('#scenes label', {state: 'attached'});
  await page.tap('nav [data-goto=training]');
  await page.tap(`[aria-label="Operate ${kScene}"]`);
  await until(page, 60, allRun, kNodes);
  await until(page, 20, drawn);
  await page.tap('#take:enabled');
  await until(page, 5, () => document.body.dataset.controls === 'you');
  await page.locator('#picture').scrollIntoViewIfNeeded();
  const box = await page.locator('#picture').boundingBox(), x = box.x + box.width / 2, y = box.y + box.height / 2;
  await touch(page, [[[x - 60, y], [x + 60, y + 20]]]);
  await touch(page, [[[x - 10, y], [x - 90, y]], [[x + 10, y], [x + 90, y]]]);
  await page.locator('[data-key=coag]').scrollIntoViewIfNeeded();
  const coag = await page.locator('[data-key=coag]').boundingBox(), middle = [coag.x + coag.width / 2, coag.y + coag.height / 2];
  const held = touch(page, [[middle, middle]]);
  await until(page, 3, () => document.querySelector('[data-key=coag]').getAttribute('aria-pressed') === 'true');
  await held;
  await until(page, 3, () => document.querySelector('[data-key=coag]').getAttribute('aria-pressed') === 'false');
  await page.screenshot({path: join(folder, 'touch-360.png')});
  await page.tap('#release');
  await page.tap('#stop');
  await page.tap('#stop-yes');

  await page.waitForSelector('#attempt-box[open]');
  await until(page, 20, shown, 'own');
  const path = await page.evaluate(() => [...document.querySelectorAll('#sheet tr')].find(row => row.textContent.startsWith('path')).cells[1].textContent);
  expect(Number(path) > 5, `the fingers have moved the tool, but by ${path} mm`);
  const pedal = page.locator('#own-events button', {hasText: 'Pedal coag'}).first();
  const at = parseFloat(await pedal.textContent());
  await pedal.tap();
  expect(Math.abs(await scrubTime(page) - at) <= 0.06, `a tap jumps to the event at ${at} s, but to ${await scrubTime(page)} s`);
  await page.tap('#play');
  await until(page, 5, from => Number(document.getElementById('scrub').value) > from, at);
  await page.tap('#play');
  // A tap on the lane jumps to the nearest mark.
  const lane = await page.locator('#own-lane').boundingBox(), mark = await page.locator('#own-lane .sign').first().boundingBox();
  await page.touchscreen.tap(mark.x + mark.width / 2, lane.y + lane.height / 2);
  const first = parseFloat(await page.locator('#own-events button').first().textContent());
  expect(Math.abs(await scrubTime(page) - first) <= 0.06, `a tap on a mark jumps to ${first} s, but to ${await scrubTime(page)} s`);
  await page.tap('#attempt-close');
  await until(page, 5, () => !document.getElementById('attempt-box').open);
}

try {
  // Three others, who have attempted the exercise for a second each.
  for (const name of ['Berthold', 'Cyprian', 'Dietrich']) {
    execFileSync(fulcrum, ['up', kScene, '--seconds', '1', '--domain', String(kDomain), '--hands', 'script', '--trainee', name, '--out', join(state, 'others')], {stdio: 'pipe'});
  }
  await withConsole(fulcrum, browser, kDomain, async use => {
    await byKeyboard(use);
    await byTouch(use);
  });
} finally {
  rmSync(state, {recursive: true, force: true});
}
console.log('by keyboard and by touch alone an exercise was operated, and its events and trend were read');
