// What check and measure share: a console in a folder of its own, a browser on its page.
import {spawn} from 'node:child_process';
import {mkdtempSync, readFileSync, readdirSync, rmSync} from 'node:fs';
import {tmpdir} from 'node:os';
import {join} from 'node:path';
import {chromium} from 'playwright-core';
import {axe, faultsOf} from './contrast.mjs';

export const sizes = [{width: 1280, height: 800}, {width: 1920, height: 1080}, {width: 360, height: 740}];

export function expect(condition, what) {
  if (!condition) throw new Error(`expected: ${what}`);
}

/** Runs `use({page, console, newPage})`, and ends everything afterwards. */
export async function withConsole(fulcrum, browserPath, domain, use) {
  const out = mkdtempSync(join(tmpdir(), 'fulcrum-console-'));
  const program = spawn(fulcrum, ['console', '--port', '0', '--domain', String(domain), '--out', join(out, 'out'), '--token-file', join(out, 'token')]);
  let said = '';
  let browser = null;
  const trouble = [];
  try {
    const address = await new Promise((found, failed) => {
      const hear = bytes => {
        said += bytes;
        const match = said.match(/open (http:\S+)#TOKEN\n/);
        if (match) found(`${match[1]}#${readFileSync(join(out, 'token'), 'utf8').trim()}`);
      };
      program.stdout.on('data', hear);
      program.stderr.on('data', hear);
      program.on('exit', () => failed(new Error(`the console ended: ${said}`)));
      setTimeout(() => failed(new Error(`the console does not listen: ${said}`)), kLongest_ms);
    });
    browser = await chromium.launch({executablePath: browserPath, args: ['--no-sandbox', '--disable-dev-shm-usage', '--disable-gpu', '--force-color-profile=srgb']});
    const newPage = async (size, more) => {
      const page = await (await browser.newContext({viewport: size, ...more})).newPage();
      page.setDefaultTimeout(kLongest_ms);
      await page.addInitScript({content: axe});
      page.on('pageerror', error => trouble.push(`error in the page: ${error.message}`));
      page.on('console', message => { if (message.type() === 'error') trouble.push(`console: ${message.text()}`); });
      page.on('response', async response => {
        if (response.status() >= 400) trouble.push(`${response.url()}: ${response.status()} ${await response.text().catch(() => '')}`);
      });
      page.on('request', request => { if (!request.url().startsWith(new URL(address).origin)) trouble.push(`asks elsewhere: ${request.url()}`); });
      return page;
    };
    await use({address, newPage, trouble, pid: program.pid, out: join(out, 'out')});
    expect(trouble.length === 0, `no trouble in the page, but: ${trouble.join('; ')}`);
  } catch (error) {
    let log = '';
    try { log = readFileSync(join(out, 'out', 'console.log'), 'utf8'); } catch { /* no session */ }
    console.error(`trouble in the page: ${trouble.join('; ') || 'none'}\nfulcrum up said:\n${log.slice(-2000)}`);
    throw error;
  } finally {
    await browser?.close();
    const gone = new Promise(done => program.once('exit', done));
    if (program.exitCode === null && program.kill('SIGTERM')) await gone;
    // A session that still runs writes there; its trouble must not hide the one above.
    try { rmSync(out, {recursive: true, force: true}); } catch { /* left behind */ }
  }
}

/** The process of a node of the session in `out`. */
export function pidOf(node, out) {
  for (const name of readdirSync('/proc')) {
    if (!/^\d+$/.test(name)) continue;
    try {
      const words = readFileSync(`/proc/${name}/cmdline`, 'utf8').split('\0');
      if (words[0].endsWith(`/${node}`) && words.some(word => word.startsWith(out))) return Number(name);
    } catch { /* it has just ended */ }
  }
  throw new Error(`${node} does not run`);
}

// Times in these tests are those that a free machine needs with ease. A busy one gets so many times as much.
const kPatience = 4;
const kLongest_ms = kPatience * 40_000;

/** Waits until `done(argument)` in the page is true; `limit_s` is for a free machine. The driver's own way evaluates texts, which the page's policy refuses. */
export async function until(page, limit_s, done, argument) {
  const begin = performance.now();
  while (!(await page.evaluate(done, argument))) {
    if (performance.now() - begin > 1000 * kPatience * limit_s) throw new Error(`after ${kPatience * limit_s} s it does not hold: ${done}`);
    await new Promise(next => setTimeout(next, 100));
  }
}

/** The page shows live pictures; while nothing moves it gets only the first. */
export const drawn = () => Number(document.getElementById('picture').dataset.live || 0) > 0;

/** Waits until `nodes` nodes run and the page shows them live, and takes the controls by mouse. */
export async function takeControls(page, nodes) {
  await until(page, 60, allRun, nodes);
  await until(page, 20, drawn);
  await page.click('#take:enabled');
  await until(page, 5, () => document.body.dataset.controls === 'you');
}

/** All nodes run; slow ones, on a busy machine, too. */
export const allRun = count => document.querySelectorAll('#nodes .word.level-good, #nodes .word.level-busy').length === count;
export const pictureShown = () => !!document.getElementById('picture').dataset.shown || !!document.getElementById('picture').dataset.live;

/** Everything that can be pressed is big enough and on the screen; nothing has to be scrolled sideways. */
async function checkLayout(page, what) {
  const found = await page.evaluate(() => {
    const bad = [], box = document.querySelector('dialog[open]'), top = box || document;
    const covered = e => e.closest('#view-session') && !document.getElementById('task').hidden;
    for (const e of top.querySelectorAll('button, input, select, label:has(input)')) {
      if (e.matches('.chips input, .check input') || !e.checkVisibility() || covered(e)) continue;
      const box = e.getBoundingClientRect();
      if (box.width < 48 || box.height < 48) bad.push(`${e.id || e.textContent}: ${box.width} x ${box.height}`);
      if (box.left < 0 || box.right > innerWidth + 0.5) bad.push(`${e.id || e.textContent}: beyond the screen`);
    }
    for (const e of [document.documentElement, box, ...top.querySelectorAll('main, section')]) {
      if (e && e.clientWidth > 0 && e.scrollWidth > e.clientWidth + 1 && getComputedStyle(e).overflowX !== 'visible') bad.push(`${e.id || e.tagName} is wider than its place`);
    }
    if (document.documentElement.scrollWidth > innerWidth) bad.push('wider than the screen');
    return bad;
  });
  expect(found.length === 0, `${what}: all targets of 48 px and on the screen, but ${found.join('; ')}`);
}

/** Looks at the present view in all sizes: layout, contrast, and what else axe-core finds. Leaves a screenshot of each in `folder`. */
export async function look(page, name, folder) {
  for (const size of sizes) {
    await page.setViewportSize(size);
    await page.waitForTimeout(300);
    await checkLayout(page, `${name} at ${size.width} x ${size.height}`);
    await page.screenshot({path: join(folder, `${name}-${size.width}.png`)});
    const {faults, texts, controls} = await faultsOf(page);
    expect(faults.length === 0, `${name} at ${size.width} x ${size.height}: no fault of access, but\n${faults.join('\n')}`);
    expect(texts > 0 && controls > 0, `${name}: contrasts were measured`);
  }
  await page.setViewportSize(sizes[0]);
}
