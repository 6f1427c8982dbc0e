// The page as an operator uses it: check.mjs FULCRUM CHROMIUM FOLDER. Leaves screenshots in FOLDER.
import {readFileSync, realpathSync} from 'node:fs';
import {join} from 'node:path';
import {allRun, expect, look, pictureShown, pidOf, sizes, until, withConsole} from './console.mjs';
import {axe, faultsOf} from './contrast.mjs';

const [fulcrum, browser, folder] = process.argv.slice(2);

await withConsole(fulcrum, browser, 65, async ({address, newPage, trouble, out}) => {
  // A stranger's page shows no session.
  const stranger = await newPage(sizes[0]);
  await stranger.goto(address.replace(/#.*/, '#wrong'));
  await stranger.waitForSelector('#ask-token[open]');
  expect(!(await stranger.isVisible('#nodes li')), 'nothing without the token');
  await look(stranger, 'token', folder);
  await stranger.context().close();
  expect(trouble.every(t => t.includes('401')), `401 alone for a stranger, but ${trouble}`);
  trouble.length = 0;

  const page = await newPage(sizes[0]);
  await page.goto(address);
  expect(!page.url().includes('#'), 'the token does not stay in the address line');
  expect(await page.getAttribute('html', 'lang') === 'en', 'a language');
  await page.waitForSelector('#scenes label');
  await look(page, 'idle', folder);
  const messages = shown => page.evaluate(on => {
    $('banner').textContent = 'No response from the console.';
    $('banner').hidden = !on;
    if (on) toast('A refusal', true); else $('toast').hidden = true;
  }, shown);
  await messages(true);
  await look(page, 'messages', folder);
  await messages(false);

  await page.locator('#scenes label', {hasText: 'small'}).click();
  await page.click('#power-less');
  expect(await page.textContent('#power') === '30 W', '5 W less than the scene says');
  await page.locator('#lengths label', {hasText: '1 min'}).click();
  // By keyboard alone from here to the start.
  await page.focus('#lengths input:checked');
  await page.keyboard.press('Tab');
  expect(await page.evaluate(() => document.activeElement.id) === 'start', 'Start is reached with Tab');
  await page.keyboard.press('Enter');
  await until(page, 60, allRun, 6);
  await until(page, 20, pictureShown);
  await until(page, 20, () => parseFloat(document.getElementById('temperature').textContent) > 60);
  await look(page, 'running', folder);

  // A node that hangs is seen, named and restarted.
  process.kill(pidOf('thermal_node', out), 'SIGSTOP');
  await until(page, 10, () => document.querySelector('[data-node=thermal_node] .word').textContent === 'Silent');
  await until(page, 5, () => document.querySelector('#warning-list').textContent.includes('Heat has been silent'));
  await look(page, 'silent', folder);
  await page.click('[data-node=thermal_node] button');
  await until(page, 20, allRun, 6);

  await page.click('#stop');
  await page.click('#stop-yes');
  await page.waitForSelector('#report:visible');
  await page.waitForSelector('#result-figures dd');
  expect(await page.textContent('#power') === '30 W', 'the power chosen before stays chosen');
  await look(page, 'ended', folder);
  await page.click('#report');
  await page.frameLocator('#report-frame').locator('h1, h2').first().waitFor();
  await page.screenshot({path: join(folder, 'report-1920.png')});
  await page.click('#report-close');

  await page.click('#questionnaire');
  await page.waitForSelector('#questionnaire-box[open] fieldset');
  expect(await page.locator('#questions fieldset').count() === 12, 'the twelve questions of the paper');
  expect((await page.textContent('#opinions-people')).includes('No session'), 'no answers yet');
  await look(page, 'questionnaire', folder);
  for (let number = 0; number < 12; ++number) await page.locator(`#questions input[name=question${number}][value="${number % 6}"]`).check({force: true});
  await page.click('#questionnaire-form button[type=submit]');
  await page.waitForSelector('#questionnaire-box:not([open])', {state: 'attached'});
  const answers = readFileSync(join(realpathSync(join(out, 'latest')), 'questionnaire.json'), 'utf8');
  expect(answers === '{"answers": [0, 1, 2, 3, 4, 5, 0, 1, 2, 3, 4, 5]}\n', `the answers are stored, but ${answers}`);
  await page.click('#questionnaire');
  await until(page, 5, () => document.querySelector('#opinions tr:nth-child(6) td:nth-child(2)').textContent.startsWith('5.0'));
  await page.click('#questionnaire-close');

  // Within the page no script may look at it.
  const report = await (await page.context().browser().newContext({viewport: sizes[0]})).newPage();
  await report.addInitScript({content: axe});
  await report.goto(`file://${realpathSync(join(out, 'latest', 'report.html'))}`);
  const {faults, texts} = await faultsOf(report);
  expect(texts > 20, `the texts of the report were measured, but ${texts}`);
  expect(faults.length === 0, `the report: no fault of access, but\n${faults.join('\n')}`);
  await report.context().close();

  await page.click('nav [data-goto=recordings]');
  await page.waitForSelector('#recordings button');
  await look(page, 'recordings', folder);
  await page.click('nav [data-goto=calibration]');
  await page.click('[data-what=handle][data-tool="0"]');
  await page.waitForSelector('#task-enter:enabled');
  await look(page, 'calibration', folder);
  await page.click('#task-cancel');
  await page.waitForSelector('#task-close:visible');
  await page.click('#task-close');
});
console.log('the page was opened, a session started, watched, healed and stopped');
