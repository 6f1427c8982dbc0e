// measure.mjs FULCRUM CHROMIUM FOLDER: prints `key value` for tests/benchmark/console.
import {readFileSync} from 'node:fs';
import {pictureShown, sizes, until, withConsole} from './console.mjs';

const [fulcrum, browser] = process.argv.slice(2);
const kLoads = 7, kWatch_s = 20;
const median = values => values.sort((a, b) => a - b)[values.length >> 1];
const cpu_s = pid => {
  const stat = readFileSync(`/proc/${pid}/stat`, 'utf8');
  const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;  // User and system, in ticks of 10 ms.
};

await withConsole(fulcrum, browser, 66, async ({address, newPage, pid}) => {
  const paints = [];
  for (let i = 0; i < kLoads; ++i) {
    const page = await newPage(sizes[0]);
    await page.goto(address);
    await page.waitForSelector('#scenes label');
    paints.push(await page.evaluate(() => performance.getEntriesByName('first-contentful-paint')[0].startTime));
    await page.context().close();
  }
  console.log(`first_paint_ms ${median(paints).toFixed(1)}`);

  const page = await newPage(sizes[0]);
  await page.goto(address);
  await page.locator('#scenes label', {hasText: 'small'}).click();
  await page.locator('#lengths label', {hasText: '5 min'}).click();
  await page.click('#start');
  await until(page, 60, pictureShown);
  const begin = cpu_s(pid), from = performance.now();
  await new Promise(done => setTimeout(done, 1000 * kWatch_s));
  console.log(`cpu_pct ${(100 * (cpu_s(pid) - begin) / (1e-3 * (performance.now() - from))).toFixed(2)}`);
  await page.click('#stop');
  await page.click('#stop-yes');
  await page.waitForSelector('#report:visible', {timeout: 30_000});
});
