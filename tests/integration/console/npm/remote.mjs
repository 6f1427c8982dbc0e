// remote.mjs FULCRUM CHROMIUM FOLDER SCENE DOMAIN: starts a console and, from its page, a session that the page operates.
// Prints `ready SESSION` when the page has the controls. Orders on standard input, one a line: `move X Y` (pixels of the
// picture, y down), `deep N` (pixels with Control, along the view), `down KEY`, `up KEY`, `end`.
import {realpathSync} from 'node:fs';
import {join} from 'node:path';
import {createInterface} from 'node:readline';
import {takeControls, withConsole} from './console.mjs';

const [fulcrum, browser, , scene, domain] = process.argv.slice(2);

// Orders are queued from the start: the browser takes them when it can.
const orders = [];
let wake = () => {};
createInterface({input: process.stdin}).on('line', line => { orders.push(line.split(' ')); wake(); })
  .on('close', () => { orders.push(['end']); wake(); });
async function next() {
  while (!orders.length) await new Promise(done => { wake = done; });
  // All motions up to the next key are one: the browser may be slower than they come.
  const motion = {x: 0, y: 0, deep: 0};
  while (orders.length && (orders[0][0] === 'move' || orders[0][0] === 'deep')) {
    const [word, ...by] = orders.shift();
    if (word === 'deep') motion.deep += Number(by[0]);
    else [motion.x, motion.y] = [motion.x + Number(by[0]), motion.y + Number(by[1])];
  }
  return motion.x || motion.y || motion.deep ? motion : orders.shift() || next();
}

try {
  await withConsole(fulcrum, browser, Number(domain), async ({address, newPage, out}) => {
    const page = await newPage({width: 1280, height: 800});
    await page.goto(address);
    await page.locator('#scenes label', {hasText: scene}).first().click();
    await page.locator('label', {hasText: 'You, on this page'}).click();
    await page.click('#start');
    await takeControls(page, 6);
    const box = await (await page.$('#picture')).boundingBox();
    const scale = await page.evaluate(() => {
      const picture = document.getElementById('picture'), size = picture.getBoundingClientRect();
      return Math.max(picture.width / size.width, picture.height / size.height);
    });
    const middle = {x: box.x + 0.5 * box.width, y: box.y + 0.5 * box.height};
    let at = {...middle};
    await page.mouse.move(at.x, at.y);
    console.log(`ready ${realpathSync(join(out, 'latest'))}`);
    /** Moves the pointer by pixels of the picture. Near its edge it goes back with the clutch, as a hand lifts a mouse. */
    async function move(x, y) {
      const by = {x: x / scale, y: y / scale};
      if (Math.abs(at.x + by.x - middle.x) > 0.4 * box.width || Math.abs(at.y + by.y - middle.y) > 0.4 * box.height) {
        await page.keyboard.down(' ');
        await page.mouse.move(middle.x, middle.y);
        await page.keyboard.up(' ');
        at = {...middle};
      }
      at = {x: at.x + by.x, y: at.y + by.y};
      await page.mouse.move(at.x, at.y);
    }
    for (let order = await next(); order[0] !== 'end'; order = await next()) {
      if (order[0] === 'down') await page.keyboard.down(order[1]);
      if (order[0] === 'up') await page.keyboard.up(order[1]);
      if (order.x || order.y) await move(order.x, order.y);
      if (order.deep) {
        await page.keyboard.down('Control');
        await move(0, -order.deep);
        await page.keyboard.up('Control');
      }
    }
    await page.keyboard.press('Escape');
    await page.click('#stop');
    await page.click('#stop-yes');
    await page.waitForSelector('#report:visible');
  });
} catch (error) {
  console.log(`failed: ${error.stack}`);
  process.exit(1);
}
process.exit(0);
