// measure_hands.mjs FULCRUM CHROMIUM FOLDER: prints `key value` for tests/benchmark/console: the live picture and the
// controls of the page, in headless Chromium on the same machine.
import {readFileSync, readdirSync} from 'node:fs';
import {allRun, drawn, pidOf, sizes, takeControls, until, withConsole} from './console.mjs';

const [fulcrum, browser] = process.argv.slice(2);
const kWatch_s = 10, kMoves = 40;
const sorted = values => [...values].sort((a, b) => a - b);
const part = (values, share) => sorted(values)[Math.min(values.length - 1, Math.floor(share * values.length))];
const cpuOf = path => {
  const stat = readFileSync(path, 'utf8');
  const fields = stat.slice(stat.lastIndexOf(')') + 2).split(' ');
  return (Number(fields[11]) + Number(fields[12])) / 100;  // User and system, in ticks of 10 ms.
};
/** Processor time of the thread that compresses pictures [s]. */
const streamCpu = pid => readdirSync(`/proc/${pid}/task`)
  .filter(id => readFileSync(`/proc/${pid}/task/${id}/comm`, 'utf8').trim() === 'picture stream')
  .reduce((sum, id) => sum + cpuOf(`/proc/${pid}/task/${id}/stat`), 0);
const live = page => page.evaluate(() => Number(document.getElementById('picture').dataset.live));
const pause = ms => new Promise(done => setTimeout(done, ms));

async function stop(page) {
  await page.click('#stop');
  await page.click('#stop-yes');
  await page.waitForSelector('#report:visible', {timeout: 30_000});
}

await withConsole(fulcrum, browser, 66, async ({address, newPage, pid, out}) => {
  // The scripted dissection of built-in, watched, and then without an open page.
  const page = await newPage(sizes[0]);
  await page.goto(address);
  await page.waitForSelector('#scenes label');
  await page.locator('#lengths label', {hasText: '1 min'}).click();
  await page.click('#start');
  await until(page, 60, allRun, 6);
  await until(page, 20, drawn);
  const render = pidOf('render_node', out);
  await page.evaluate(() => {
    window.drawnAt = [];
    new MutationObserver(() => drawnAt.push(performance.now())).observe(document.getElementById('picture'), {attributes: true, attributeFilter: ['data-live']});
  });
  let begin = {console: cpuOf(`/proc/${pid}/stat`), stream: streamCpu(render), live: await live(page), at: performance.now()};
  await pause(1000 * kWatch_s);
  const wall = 1e-3 * (performance.now() - begin.at);
  const gaps = await page.evaluate(() => drawnAt.slice(1).map((time, i) => time - drawnAt[i]));
  console.log(`browser_fps_p50 ${(1000 / part(gaps, 0.5)).toFixed(2)}`);
  console.log(`browser_fps_mean ${((await live(page) - begin.live) / wall).toFixed(2)}`);
  const used = cpuOf(`/proc/${pid}/stat`) - begin.console + streamCpu(render) - begin.stream;
  console.log(`stream_cpu_pct_of_core ${(100 * used / wall).toFixed(2)}`);
  await page.goto('about:blank');
  await pause(1000);
  begin = {stream: streamCpu(render), at: performance.now()};
  await pause(1000 * kWatch_s);
  console.log(`stream_idle_cpu_pct_of_core ${(100 * (streamCpu(render) - begin.stream) / (1e-3 * (performance.now() - begin.at))).toFixed(2)}`);
  await page.goto(address);
  await until(page, 20, () => document.body.dataset.phase === 'running');
  await stop(page);

  // From an event of the pointer to a picture that shows it.
  await page.locator('label', {hasText: 'You, on this page'}).click();
  await page.click('#start');
  await takeControls(page, 6);
  await page.evaluate(() => {
    const picture = document.getElementById('picture'), small = document.createElement('canvas');
    small.width = 240;
    small.height = 135;
    const g = small.getContext('2d', {willReadFrequently: true});
    const look = () => { g.drawImage(picture, 0, 0, 240, 135); return g.getImageData(0, 0, 240, 110).data; };
    // A moving shaft changes hundreds of pixels by much; breathing tissue changes few, and faintly.
    const differ = (a, b) => { let n = 0; for (let i = 0; i < a.length; i += 4) n += Math.abs(a[i] - b[i]) > 40; return n; };
    window.probe = {times: [], base: null, from: 0};
    picture.addEventListener('pointermove', () => {
      if (probe.armed) Object.assign(probe, {armed: false, waits: true, from: performance.now()});
    }, true);
    new MutationObserver(() => {
      const now = look();
      if (probe.waits && differ(now, probe.base) > 25) {
        probe.times.push(performance.now() - probe.from);
        probe.waits = false;
      }
      if (!probe.waits) probe.base = now;
    }).observe(picture, {attributes: true, attributeFilter: ['data-live']});
  });
  const box = await (await page.$('#picture')).boundingBox();
  const at = {x: box.x + 0.5 * box.width, y: box.y + 0.5 * box.height};
  await page.mouse.move(at.x, at.y);
  await pause(1500);
  for (let i = 0; i < kMoves; ++i) {
    await page.evaluate(() => { probe.armed = true; });
    await page.mouse.move(at.x - (i % 2 ? 0 : 60), at.y);
    await pause(700 + 13 * (i % 5));
  }
  const times = await page.evaluate(() => probe.times);
  if (times.length < 0.8 * kMoves) throw new Error(`only ${times.length} of ${kMoves} motions were seen`);
  console.log(`browser_input_to_picture_ms_p50 ${part(times, 0.5).toFixed(1)}`);
  console.log(`browser_input_to_picture_ms_p95 ${part(times, 0.95).toFixed(1)}`);
  await stop(page);
});
