// An imitation of the console: serves the page's own files, and the states and answers that a test gives. What takes a
// broken network, a lost gamepad or another keyboard to see is tested with it.
import {readFileSync} from 'node:fs';
import {createServer} from 'node:http';
import {extname, join} from 'node:path';
import {chromium} from 'playwright-core';
import {until} from './console.mjs';

const types = {'.html': 'text/html', '.js': 'text/javascript', '.css': 'text/css', '.svg': 'image/svg+xml'};

export const sleep = ms => new Promise(done => setTimeout(done, ms));

/** State without a session. */
export const idle = more => ({phase: 'idle', session: '', picture: '', own: false, recording: false, has_report: false, points: [], ...more});

/** State of a session in which a person operates two tools. */
export const running = more => ({...idle({phase: 'running', session: '20260101-000000-line', own: true, scene: 'line', time: 5, end: 20, nodes: [], warnings: []}),
  figures: {temperature_C: 37, highest_C: 37, power_W: 0, cut_mm: 0, set_cut_W: 35, set_coag_W: 30, set_blend_W: 30,
    force0_N: 0, force1_N: 0, force2_N: 0, force3_N: 0, peak_force_N: 0, hand_force_N: 0, operated_tools: 2}, ...more});

export class Imitation {
  state = idle();
  silent = false;     // Sends nothing, as a machine whose network is gone.
  answers = {};       // By path: an answer, or a function of the body that returns one.
  calls = [];         // Path and body of each request that came.
  #streams = new Set();
  #server = null;

  async start(folder) {
    this.#server = createServer((request, response) => {
      let body = '';
      request.on('data', bytes => { body += bytes; });
      request.on('end', () => this.#answer(new URL(request.url, 'http://page'), body, response, folder));
    });
    await new Promise(done => this.#server.listen(0, '127.0.0.1', done));
    this.timer = setInterval(() => this.feed(), 200);
    return `http://127.0.0.1:${this.#server.address().port}/#token`;
  }

  end() {
    clearInterval(this.timer);
    this.breakStreams();
    this.#server.close();
    this.#server.closeAllConnections();
  }

  #answer(url, body, response, folder) {
    if (url.pathname === '/api/events') {
      this.#streams.add(response);
      response.on('close', () => this.#streams.delete(response));
      if (this.silent) return;
      response.writeHead(200, {'Content-Type': 'text/event-stream'});
      return this.feed();
    }
    if (url.pathname.startsWith('/api/')) {
      this.calls.push([url.pathname, body]);
      const answer = this.answers[url.pathname] ?? {ok: true, text: 'done'};
      response.writeHead(200, {'Content-Type': 'application/json'});
      return response.end(JSON.stringify(typeof answer === 'function' ? answer(new URLSearchParams(body)) : answer));
    }
    const name = url.pathname === '/' ? '/index.html' : url.pathname;
    response.writeHead(200, {'Content-Type': types[extname(name)]});
    response.end(readFileSync(join(folder, name)));
  }

  /** Number of requests so far with this path and, if it is given, this body. */
  count(path, body) {
    return this.calls.filter(([to, text]) => to === path && (body === undefined || text === body)).length;
  }

  feed(state) {
    if (state) this.state = state;
    if (this.silent) return;
    for (const stream of this.#streams) stream.write(`data: ${JSON.stringify(this.state)}\n\n`);
  }

  breakStreams() {
    for (const stream of this.#streams) stream.destroy();
  }
}

/** Opens the page with gamepads `pads`, which counts how often the page reads them in `reads`, and with a socket that grants the controls to each request and keeps what is sent in `sent`. */
export async function openPage(browserPath, address) {
  const browser = await chromium.launch({executablePath: browserPath, args: ['--no-sandbox', '--disable-dev-shm-usage', '--disable-gpu']});
  const page = await browser.newPage({viewport: {width: 1280, height: 800}});
  await page.addInitScript(() => {
    window.sent = [];
    window.pads = [];
    window.reads = 0;
    navigator.getGamepads = () => {
      ++window.reads;
      return window.pads;
    };
    window.WebSocket = class {
      static OPEN = 1;
      readyState = 1;
      constructor() { setTimeout(() => this.say('none'), 20); }
      say(controls) { this.onmessage({data: JSON.stringify({controls, ready: true, tool: 1, locked: false, steady: false, present: 3, scope: false})}); }
      send(form) {
        const text = form.toString();
        window.sent.push(text);
        if (text === 'take=1') this.say('you');
        if (text === 'release=1') this.say('none');
      }
      close() { this.onclose(); }
    };
  });
  await page.goto(address);
  return {browser, page};
}

/** Waits until the page has read the gamepads, and sent what its keys and buttons move, `count` times more. */
export async function beats(page, count) {
  const from = await page.evaluate(() => window.reads);
  await until(page, 5, end => window.reads >= end, from + count + 1);
}

/** What the page has sent since the last call, but motions. */
export const keysOf = page => page.evaluate(() => window.sent.splice(0).filter(text => !text.startsWith('x=')));
