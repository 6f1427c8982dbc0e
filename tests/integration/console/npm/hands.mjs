// The live picture and the controls as a person uses them: hands.mjs FULCRUM CHROMIUM FOLDER. Leaves screenshots in FOLDER.
import {join} from 'node:path';
import {allRun, drawn, expect, sizes, until, withConsole} from './console.mjs';

const [fulcrum, browser, folder] = process.argv.slice(2);
const figure = (page, name) => page.evaluate(key => state.figures[key], name);

/** Holds keys until `done` holds, as a hand does that watches the picture. */
async function hold(page, keys, limit_s, done) {
  for (const key of keys) await page.keyboard.down(key);
  try {
    await until(page, limit_s, done);
  } finally {
    for (const key of keys) await page.keyboard.up(key);
  }
}

await withConsole(fulcrum, browser, 62, async ({address, newPage}) => {
  const page = await newPage(sizes[0]);
  await page.goto(address);
  await page.locator('#scenes label', {hasText: 'small'}).click();
  await page.locator('label', {hasText: 'You, on this page'}).click();
  await page.click('#start');
  await until(page, 60, allRun, 6);
  await until(page, 20, drawn);
  expect(await page.textContent('#hands-state') === 'Nobody has the controls; the tools stand still.', 'nobody operates yet');

  await page.focus('#take');
  await page.keyboard.press('Enter');
  await until(page, 5, () => document.body.dataset.controls === 'you');
  expect(await page.evaluate(() => {
    const box = document.getElementById('picture').getBoundingClientRect();
    return document.elementFromPoint(box.x + box.width / 2, box.y + box.height / 2).id;
  }) === 'picture', 'the pointer reaches the picture');
  await page.focus('#picture');
  await hold(page, ['PageDown'], 30, () => Math.max(state.figures.force0_N, state.figures.force1_N) > 0.05);
  await page.keyboard.down('f');
  await until(page, 5, () => document.querySelector('[data-key=cut]').getAttribute('aria-pressed') === 'true');
  await page.screenshot({path: join(folder, 'hands-1280.png')});
  // A quarter of the speed: at full speed the hook leaves the tissue before it has cut.
  await hold(page, ['Shift', 'ArrowUp'], 30, () => state.figures.cut_mm >= 2);
  await page.keyboard.up('f');
  await until(page, 5, () => state.figures.power_W < 0.5);

  // A second page takes over; the first loses the controls.
  const second = await newPage(sizes[1]);
  await second.goto(address);
  await until(second, 20, drawn);
  await second.click('#take');
  await until(page, 5, () => document.body.dataset.controls === 'browser');
  expect(await page.textContent('#hands-state') === 'Another page has the controls.', 'the first page says who operates');
  // A pedal by touch or mouse is held as long as the button.
  await second.hover('[data-key=coag]');
  await second.mouse.down();
  await until(second, 5, () => document.querySelector('[data-key=coag]').getAttribute('aria-pressed') === 'true');
  await second.screenshot({path: join(folder, 'hands-1920.png')});
  // The tab is closed while the pedal is held: it rises.
  await second.context().close();
  await until(page, 5, () => document.body.dataset.controls === 'none' && state.figures.power_W < 0.5);
  expect(await figure(page, 'cut_mm') >= 2, 'the cut stays');

  await page.click('#take');
  await until(page, 5, () => document.body.dataset.controls === 'you');
  await page.focus('#picture');
  await page.keyboard.press('Escape');
  await until(page, 5, () => document.body.dataset.controls === 'none');
  await page.click('#stop');
  await page.click('#stop-yes');
  await page.waitForSelector('#report:visible');
});
console.log('a person on the page took the controls, touched the tissue, cut 2 mm, handed over and released');
