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
    await page.waitForSelector('#attempt-box[open]', {timeout: 40_000});
    expect(await page.locator('#sheet tr').count() >= 5, 'a sheet of scored measures');
    await until(page, 5, () => document.getElementById('film-own').dataset.name && document.getElementById('film-expert').dataset.name);
    const first = await page.evaluate(() => document.getElementById('film-own').dataset.name);
    await page.selectOption('#speed', '4');
    await page.click('#play');
    await until(page, 10, name => document.getElementById('film-own').dataset.name !== name, first);
    await page.click('#play');
    await page.evaluate(() => { const s = document.getElementById('scrub'); s.value = 0.6 * s.max; s.dispatchEvent(new Event('input')); });
    await until(page, 5, name => document.getElementById('film-own').dataset.name > name, first);
    await new Promise(done => setTimeout(done, 500));
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
