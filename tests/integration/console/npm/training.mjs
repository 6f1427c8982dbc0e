// A trainee's way through the page, from the account to the replay of the first attempt: training.mjs FULCRUM CHROMIUM
// FOLDER. Leaves screenshots in FOLDER, which deploy/docs/build puts into the documentation.
import {mkdtempSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {allRun, drawn, expect, sizes, until, withConsole} from './console.mjs';

const [fulcrum, browser, folder] = process.argv.slice(2);
const state = mkdtempSync(join(tmpdir(), 'fulcrum-training-'));
process.env.XDG_STATE_HOME = state;

try {
  await withConsole(fulcrum, browser, 63, async ({address, newPage}) => {
    const page = await newPage(sizes[0]);
    const shot = name => page.screenshot({path: join(folder, `training-${name}.jpg`), type: 'jpeg', quality: 80});
    await page.goto(address);
    await page.waitForSelector('#scenes label');
    await page.click('nav [data-goto=training]');
    await page.waitForSelector('#courses li');
    expect(await page.locator('#courses li').count() >= 10, 'ten exercises');
    expect(await page.isDisabled('[aria-label="Operate strokes"]'), 'nobody operates for a score without an account');

    // By the keyboard alone: name, PIN, New account.
    await page.focus('[name=person_name]');
    await page.keyboard.type('A. Trainee');
    await page.keyboard.press('Tab');
    await page.keyboard.type('2468');
    await page.keyboard.press('Tab');
    await page.keyboard.press('Tab');
    await page.keyboard.press('Enter');
    await until(page, 5, () => document.getElementById('person').textContent === 'A. Trainee');
    await shot('courses');

    // The demonstration is stored for the comparison.
    await page.click('[aria-label="Demonstration of strokes"]');
    await until(page, 60, allRun, 5);
    await until(page, 60, () => document.body.dataset.phase === 'idle' && !document.getElementById('result').hidden);

    await page.click('nav [data-goto=training]');
    await page.click('[aria-label="Operate strokes"]');
    await until(page, 60, allRun, 5);
    await until(page, 20, drawn);
    await page.waitForSelector('#take:enabled');
    await page.focus('#take');
    await page.keyboard.press('Enter');
    await until(page, 5, () => document.body.dataset.controls === 'you');
    await page.focus('#picture');
    for (const key of ['ArrowUp', 'PageDown', 'ArrowLeft']) {
      await page.keyboard.down(key);
      await new Promise(done => setTimeout(done, 1500));
      await page.keyboard.up(key);
    }
    await shot('operating');
    await page.keyboard.press('Escape');
    await page.click('#stop');
    await page.click('#stop-yes');

    // The attempt opens by itself: sheet, picture and demonstration.
    await page.waitForSelector('#attempt-box[open]');
    expect(await page.locator('#sheet tr').count() >= 5, 'a sheet of scored measures');
    // Both recordings are drawn anew, for any time and at any speed.
    const shows = t => ['own', 'expert'].every(side => Math.abs(Number(document.getElementById(`film-${side}`).dataset.time) - t) < 0.06);
    const seen = () => page.evaluate(() => ['own', 'expert'].map(side => Number(document.getElementById(`film-${side}`).dataset.pictures || 0)));
    const jump = t => page.evaluate(to => { const s = document.getElementById('scrub'); s.value = to; s.dispatchEvent(new Event('input')); }, t);
    await until(page, 20, shows, 0);
    expect(await page.evaluate(() => Number(document.getElementById('scrub').max)) > 4, 'the slider is as long as the recordings');
    for (const speed of ['0.25', '4']) {
      const [own, expert] = await seen();
      await page.selectOption('#speed', speed);
      // Both clicks and the second between them are timed in the page: a late driver changes nothing.
      const {way, due, longest} = await page.evaluate(async () => {
        const scrub = document.getElementById('scrub'), play = document.getElementById('play'), from = Number(scrub.value), begin = performance.now();
        let longest = 0, last = begin;
        play.click();
        while (last - begin < 1000) {
          await new Promise(done => setTimeout(done, 25));
          longest = Math.max(longest, performance.now() - last);
          last = performance.now();
        }
        play.click();
        const speed = Number(document.getElementById('speed').value);
        return {way: Number(scrub.value) - from, due: Math.min(speed * (last - begin) / 1000, Number(scrub.max) - from), longest: speed * longest / 1000};
      });
      // The replay's last step may be as old as the longest pause between two; the slider has steps of 0.05 s.
      expect(Math.abs(way - due) < 2 * longest + 0.06, `a second at the speed ${speed} shows ${due} s, but ${way} s`);
      // How many is the machine's: both are drawn anew, on the processor.
      await until(page, 20, ([o, e]) => ['own', 'expert'].every((side, i) => Number(document.getElementById(`film-${side}`).dataset.pictures || 0) > [o, e][i]), [own, expert]);
      const [own_now, expert_now] = await seen();
      console.log(`a second of the replay at the speed ${speed}: ${own_now - own} and ${expert_now - expert} pictures`);
    }
    for (const t of [1, 3]) {
      await jump(t);
      await until(page, 60, shows, t);
    }
    expect(await page.evaluate(() => document.getElementById('film-own-note').textContent) === '', 'no trouble with the recording');
    await shot('attempt');
    await page.click('#attempt-close');
    expect(await page.locator('#attempts li button').count() === 1, 'one attempt');
    const [download] = await Promise.all([page.waitForEvent('download'), page.click('#csv')]);
    expect(download.suggestedFilename() === 'attempts.csv', 'the attempts as CSV');

    // A wrong PIN is refused, and another trainee sees nothing of the first.
    await page.click('#leave');
    await until(page, 5, () => document.getElementById('person').textContent.startsWith('Nobody'));
    const answers = await page.evaluate(async () => [
      await (await call('/api/training/new', {name: 'Another', pin: '1357'})).json(),
      (await (await call('/api/training')).json()).attempts.length]);
    expect(answers[0].ok && answers[1] === 0, 'a new trainee has no attempts');
    const phone = await newPage(sizes[2]);
    await phone.goto(address);
    await phone.waitForSelector('#scenes label', {state: 'attached'});
    await phone.click('nav [data-goto=training]');
    await phone.waitForSelector('#courses li');
    expect(await phone.evaluate(() => document.documentElement.scrollWidth <= 360), 'no sideways scrolling at 360 px');
    await phone.screenshot({path: join(folder, 'training-360.png')});
  });
} finally {
  rmSync(state, {recursive: true, force: true});
}
console.log('a trainee made an account, saw the demonstration, operated, and saw score and replay');
