'use strict';
// The live picture and the operator's controls, over one WebSocket: pictures come as JPEG files, the state of the controls
// as JSON; motions and keys go as forms (services/session/console/live_view.h).

const live = (() => {
  const kBeat = 20;      // ms between two messages while the controls are taken; without one for 250 ms the tools stop.
  const kStick = 9;      // Pixels of the picture per beat at the end of a stick's way, or while an arrow key is held.
  const kTwist = 1;      // Degrees about the shaft per beat at the end of a stick's way.
  const kTurn = 5;       // Degrees about the shaft for a press of q or e.
  const kTools = ['left tool', 'right tool', 'tool 3', 'tool 4'];
  const kKeys = {j: 'jaw', k: 'lock', f: 'cut', g: 'coag', 1: 'tool0', 2: 'tool1', 3: 'tool2', 4: 'tool3', v: 'steady', ' ': 'clutch', Shift: 'fine', Control: 'depth'};
  const kButtons = ['jaw', 'coag', 'cut'];  // Of the mouse: left, middle, right.
  const kPadButtons = {0: 'jaw', 1: 'lock', 2: 'fine', 3: 'steady', 4: 'tool0', 5: 'tool1', 12: 'tool2', 13: 'tool3', 6: 'coag', 7: 'cut', 10: 'clutch'};
  const kPadRelease = 8, kPadTake = 9;  // Back, Start.

  let socket = null, connecting = false, seen = 0, hands = {controls: 'none'}, operated = false, running = false;
  let x = 0, y = 0, turn = 0, roll = 0;
  const down = new Set();
  const held = new Map();  // By code of a key of the keyboard that is down: what it pressed, or the name of an arrow key.
  let padName = '', padDown = new Set(), padOperates = false;

  const mine = () => hands.controls === 'you';

  function send(fields) {
    if (socket && socket.readyState === WebSocket.OPEN) socket.send(new URLSearchParams(fields));
  }
  /** Sends what the pointer and the wheel have done since the last time; less than a step of depth waits. */
  function sendMotion() {
    const whole = Math.trunc(turn);
    send({x: x.toFixed(2), y: y.toFixed(2), turn: whole, roll: roll.toFixed(2)});
    x = y = roll = 0;
    turn -= whole;
  }
  function press(key, pressed) {
    if (!mine() || down.has(key) === pressed) return;
    if (pressed) down.add(key); else down.delete(key);
    sendMotion();  // What the pointer did before the key counts without the key.
    send({[pressed ? 'down' : 'up']: key});
    showKeys();
  }
  function letGo() {
    for (const key of [...down]) press(key, false);
    held.clear();
  }
  function release() {
    letGo();
    send({release: 1});
    if (document.pointerLockElement) document.exitPointerLock();
  }

  // ---------------------------------------------------------------------------------------------- the connection

  async function connect() {
    if (socket || connecting || !running) return;
    connecting = true;
    try {
      const opened = await openSocket('/live');
      opened.onmessage = take;
      opened.onclose = () => {
        socket = null;
        seen = 0;
        delete $('picture').dataset.live;
        takeState({controls: 'none'});
        if (running) setTimeout(connect, 1000);
      };
      socket = opened;
    } catch (error) { setTimeout(connect, 2000); }
    connecting = false;
  }

  async function take(message) {
    if (typeof message.data === 'string') return takeState(JSON.parse(message.data));
    try {
      await drawPicture(new Blob([message.data], {type: 'image/jpeg'}));
    } catch (error) { /* The next picture replaces it. */ }
    ++seen;
    $('picture').dataset.live = seen;
    send({seen});
  }

  function takeState(state) {
    const had = mine();
    if (state.trouble && state.trouble !== hands.trouble) toast(`No live picture: ${state.trouble}`, true);
    hands = state;
    document.body.dataset.controls = hands.controls;
    if (had && !mine()) {
      padOperates = false;
      down.clear();
      held.clear();
      if (document.pointerLockElement) document.exitPointerLock();
    }
    showKeys();
  }

  function showKeys() {
    $('hands').hidden = !operated || !socket;
    if ($('hands').hidden) return;
    const tool = hands.scope ? 'scope' : kTools[hands.tool];
    const locked = !hands.locked ? '' : hands.scope ? ', zoomed' : ', jaw locked';
    const text = {you: `You operate the ${tool}${locked}${hands.steady ? ', tremor filter on' : ''}.`,
      browser: 'Another page has the controls.', window: 'The window has the controls.', program: 'A program has the controls.',
      none: 'Nobody has the controls; the tools stand still.'}[hands.controls];
    setText($('hands-state'), text);
    $('take').hidden = mine();
    $('take').disabled = !hands.ready;
    // The button that started the session is hidden; the keyboard goes on here.
    if (!mine() && hands.ready && document.activeElement === document.body) $('take').focus();
    $('release').hidden = !mine();
    for (const button of document.querySelectorAll('#hands .held')) {
      button.hidden = !mine();
      const key = button.dataset.key;
      const chosen = key && key.startsWith('tool') ? Number(key.slice(4)) : -1;
      // The first two tools always have a button; a third is rare.
      if (chosen >= 2) button.hidden = !mine() || !(hands.present >> chosen & 1);
      const on = key === 'lock' ? hands.locked : chosen >= 0 ? hands.tool === chosen : down.has(key);
      if (key) button.setAttribute('aria-pressed', on ? 'true' : 'false');
    }
  }

  // ------------------------------------------------------------------------------------------------- the inputs

  /** Pixels of the picture per CSS pixel: the canvas shows the whole picture in a box of another shape. */
  function scale() {
    const canvas = $('picture'), box = canvas.getBoundingClientRect();
    return Math.max(canvas.width / Math.max(1, box.width), canvas.height / Math.max(1, box.height));
  }
  function move(dx, dy) {
    x += dx * scale();
    y -= dy * scale();
  }

  function start() {
    send({take: 1});
    $('picture').focus();
  }
  $('take').addEventListener('click', start);
  $('release').addEventListener('click', release);

  const canvas = $('picture');
  canvas.tabIndex = 0;
  canvas.addEventListener('pointerdown', event => {
    if (!mine()) return;
    canvas.focus();
    if (event.pointerType === 'touch') return;
    event.preventDefault();
    // The first click takes the pointer, so that the hand never reaches the screen's edge.
    if (document.pointerLockElement !== canvas && canvas.requestPointerLock) {
      const locked = canvas.requestPointerLock();
      if (locked && locked.catch) locked.catch(() => {});  // Without a lock the pointer works inside the picture.
      return;
    }
    press(kButtons[event.button], true);
  });
  window.addEventListener('pointerup', event => {
    if (event.pointerType !== 'touch') press(kButtons[event.button], false);
  });
  // A button beside one that is held arrives as a move.
  window.addEventListener('mousedown', event => { if (document.pointerLockElement === canvas) press(kButtons[event.button], true); });
  window.addEventListener('mouseup', event => press(kButtons[event.button], false));
  canvas.addEventListener('contextmenu', event => { if (mine()) event.preventDefault(); });
  canvas.addEventListener('pointermove', event => {
    if (mine() && event.pointerType !== 'touch') move(event.movementX, event.movementY);
  });
  canvas.addEventListener('wheel', event => {
    if (!mine()) return;
    event.preventDefault();
    turn -= Math.sign(event.deltaY);
  }, {passive: false});
  document.addEventListener('pointerlockchange', () => { if (!document.pointerLockElement && mine()) release(); });

  let fingers = [];
  const spread = touches => touches.length < 2 ? 0 : Math.hypot(touches[0].clientX - touches[1].clientX, touches[0].clientY - touches[1].clientY);
  const kLeastTwist = 2;  // Degrees between two fingers.
  const angle = touches => 180 / Math.PI * Math.atan2(touches[1].clientY - touches[0].clientY, touches[1].clientX - touches[0].clientX);
  const places = touches => [...touches].map(t => ({clientX: t.clientX, clientY: t.clientY}));
  for (const kind of ['touchstart', 'touchend', 'touchcancel']) canvas.addEventListener(kind, event => { fingers = places(event.targetTouches); });
  canvas.addEventListener('touchmove', event => {
    if (!mine()) return;
    event.preventDefault();
    const now = places(event.targetTouches);
    if (now.length === 1 && fingers.length === 1) move(now[0].clientX - fingers[0].clientX, now[0].clientY - fingers[0].clientY);
    if (now.length === 2 && fingers.length === 2) {
      const steps = Math.trunc((spread(now) - spread(fingers)) / 12), twist = angle(now) - angle(fingers);
      const degrees = (twist + 540) % 360 - 180;  // The shorter way round.
      if (!steps && Math.abs(degrees) < kLeastTwist) return;  // Small changes add up.
      turn += steps;
      roll += degrees;
    }
    fingers = now;
  }, {passive: false});

  const typing = () => ['INPUT', 'TEXTAREA', 'SELECT'].includes(document.activeElement.tagName) || document.querySelector('dialog[open]');
  // Digits by their place, because some keyboards have them with Shift only.
  const keyOf = event => {
    const digit = event.code.match(/^(?:Digit|Numpad)([1-4])$/);
    return kKeys[digit ? digit[1] : event.key] || kKeys[event.key.toLowerCase()];
  };
  const isArrow = key => key.startsWith('Arrow') || key.startsWith('Page');
  const holds = key => [...held.values()].includes(key);
  window.addEventListener('keydown', event => {
    if (!mine() || typing()) return;
    if (event.key === 'Escape') return release();
    // A button that has the focus is pressed by the space bar.
    if (event.key === ' ' && document.activeElement.tagName === 'BUTTON') return;
    const letter = event.key.toLowerCase(), key = isArrow(event.key) ? event.key : keyOf(event);
    if (letter === 'q' || letter === 'e') roll += letter === 'q' ? -kTurn : kTurn;
    else if (!key || (event.repeat && !isArrow(key))) return;
    else {
      held.set(event.code, key);
      if (!isArrow(key)) press(key, true);
    }
    event.preventDefault();
  });
  window.addEventListener('keyup', event => {
    // The key that was pressed, whatever it would write now: Shift may have changed in between.
    const key = held.get(event.code);
    held.delete(event.code);
    if (key && !isArrow(key)) press(key, false);
  });
  window.addEventListener('blur', () => { if (mine()) release(); });

  for (const button of document.querySelectorAll('#hands .held')) {
    const set = pressed => {
      if (button.dataset.key) return press(button.dataset.key, pressed);
      button.dataset.down = pressed ? '1' : '';
    };
    button.addEventListener('pointerdown', event => {
      event.preventDefault();
      button.setPointerCapture(event.pointerId);
      set(true);
    });
    for (const kind of ['pointerup', 'pointercancel', 'lostpointercapture']) button.addEventListener(kind, () => set(false));
    button.addEventListener('keydown', event => { if (event.key === 'Enter' || event.key === ' ') set(true); });
    button.addEventListener('keyup', event => { if (event.key === 'Enter' || event.key === ' ') set(false); });
    button.addEventListener('blur', () => set(false));  // The key goes up elsewhere.
  }

  /** Follows the gamepad also while the controls are released: a button counts only if it is pressed after they were taken. */
  function readPad() {
    const pad = [...(navigator.getGamepads ? navigator.getGamepads() : [])].find(p => p && p.connected);
    const name = pad ? `${pad.index} ${pad.id}` : '';
    const pressed = new Set(pad ? [...pad.buttons.keys()].filter(i => pad.buttons[i].pressed) : []);
    if (name !== padName) {
      // What it held would stay down.
      if (mine() && padOperates) release();
      padName = name;
      padDown = pressed;
      padOperates = false;
    }
    if (!pad) return;
    const fresh = [...pressed].filter(i => !padDown.has(i)), up = [...padDown].filter(i => !pressed.has(i));
    padDown = pressed;
    if (!mine()) {
      if (!fresh.includes(kPadTake) || !operated || !hands.ready) return;
      padOperates = true;
      return start();
    }
    if (fresh.includes(kPadRelease)) return release();
    const [side, back, twist, depth] = [0, 1, 2, 3].map(axis => pad.axes[axis] || 0).map(v => Math.abs(v) < 0.12 ? 0 : v);
    x += kStick * side;
    y -= kStick * back;
    turn -= 0.5 * depth;
    roll += kTwist * twist;
    for (const i of fresh) if (kPadButtons[i]) press(kPadButtons[i], true);
    for (const i of up) if (kPadButtons[i]) press(kPadButtons[i], false);
    if (fresh.length || side || back || twist || depth) padOperates = true;
  }

  setInterval(() => {
    if (running) readPad();
    if (!mine()) return;
    x += kStick * (holds('ArrowRight') - holds('ArrowLeft'));
    y += kStick * (holds('ArrowUp') - holds('ArrowDown'));
    for (const button of document.querySelectorAll('#hands [data-step]')) if (button.dataset.down) turn += 0.2 * Number(button.dataset.step);
    turn += 0.2 * (holds('PageDown') - holds('PageUp'));
    sendMotion();
  }, kBeat);

  return {
    /** Called with each state of the session. */
    show(s) {
      running = s.phase === 'running';
      operated = running && !!s.figures && s.figures.operated_tools > 0;
      if (!running && socket) socket.close();
      connect();
      showKeys();
    },
    shows: () => socket !== null && seen > 0,
  };
})();
