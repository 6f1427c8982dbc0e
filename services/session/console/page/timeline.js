'use strict';
// What happened when in an attempt and in its demonstration: marks above the slider of a replay, and lists of buttons.
// Each kind has a shape, a colour and a word.

const timeline = (() => {
  // Mark, word on the lane, colour (console.css). The order is that in which words get their place on the lane.
  const kKinds = {
    ureter_injury: ['✖', 'Ureter!', 'level-bad'], nerve_injury: ['✖', 'Nerve!', 'level-bad'],
    ureter_warning: ['▲', 'Ureter', 'level-busy'], nerve_warning: ['▲', 'Nerve', 'level-busy'],
    organ_burnt: ['▲', 'Organ', 'level-busy'],
    force: ['▲', 'Force', 'level-busy'], slip: ['△', 'Slip', 'level-busy'],
    pedal_cut: ['■', 'Pedal cut', 'cut-mark'], pedal_coag: ['■', 'Pedal coag', 'coag-mark'], pedal_blend: ['■', 'Pedal blend', 'cut-mark'],
    clip: ['▣', 'Clip', 'hand-mark'], grasp: ['▼', 'Grasp', 'hand-mark'], release: ['▽', 'Release', 'hand-mark'], touch: ['◇', 'Touch', 'hand-mark'],
    cut: ['◆', 'Cut', 'heat-mark'], charring: ['⬟', 'Char', 'heat-mark'], blanching: ['●', 'Blanching', 'heat-mark'],
    steam: ['○', 'Steam', 'heat-mark'], current: ['✦', 'Current', 'heat-mark'], region_reset: ['□', 'Reset', 'level-off'],
  };
  const kOrder = Object.keys(kKinds);
  const kindOf = event => kKinds[event.kind] || ['□', event.text, 'level-off'];
  const lasting = event => event.until - event.t >= 0.1;

  let sides = [], shown = 0, jump = () => {};

  /** Events of a session; asks until the recording has been read. */
  async function ask(session, still) {
    for (;;) {
      const answer = await call(`/api/attempt/events?session=${session}`).then(r => r.json()).catch(() => null);
      if (!still()) return null;
      if (!answer || answer.ready === undefined) return {events: [], why: answer ? answer.text : 'No response from the console.', left_out: 0};
      if (answer.ready) return answer;
      await new Promise(next => setTimeout(next, 400));
    }
  }

  function fill(side) {
    const {answer} = side, list = $(`${side.id}-events`);
    if (!answer) return;
    side.buttons = answer.events.map(event => {
      const [mark, , colour] = kindOf(event), button = make('button', 'event'), item = make('li'), sign = make('span', `sign ${colour}`, mark);
      sign.setAttribute('aria-hidden', 'true');
      button.type = 'button';
      button.append(make('span', 'at', `${event.t.toFixed(1)} s`), sign, make('span', 'text', event.text + (lasting(event) ? ` for ${(event.until - event.t).toFixed(1)} s` : '')));
      button.addEventListener('click', () => jump(event.t));
      item.append(button);
      list.append(item);
      return button;
    });
    const note = answer.why || (answer.left_out > 0 ? `${answer.left_out} more are not shown.` : answer.events.length ? '' : 'Nothing happened.');
    setText($(`${side.id}-events-note`), note);
    draw(side);
  }

  /** Marks on the lane; its ends are those of the slider's way. */
  function draw(side) {
    const lane = $(`${side.id}-lane`), end = Number($('scrub').max);
    lane.replaceChildren();
    if (!side.answer || !(end > 0)) return;
    const width = lane.clientWidth, at = t => width * Math.min(1, t / end), taken = [];
    for (const event of side.answer.events) {
      const [mark, , colour] = kindOf(event), sign = make('span', `sign ${colour}`, mark);
      sign.style.left = `${at(event.t)}px`;
      if (lasting(event)) {
        const bar = make('span', `bar ${colour}`);
        bar.style.left = `${at(event.t)}px`;
        bar.style.width = `${at(event.until) - at(event.t)}px`;
        lane.append(bar);
      }
      lane.append(sign);
    }
    // Words where there is room, the gravest first.
    const rank = event => kOrder.indexOf(event.kind) >>> 0;
    for (const event of [...side.answer.events].sort((a, b) => rank(a) - rank(b) || a.t - b.t)) {
      const word = make('span', 'word', kindOf(event)[1]);
      lane.append(word);
      const left = Math.max(0, Math.min(width - word.offsetWidth, at(event.t) - 6)), right = left + word.offsetWidth + 6;
      if (taken.some(([a, b]) => left < b && right > a)) { word.remove(); continue; }
      taken.push([left, right]);
      word.style.left = `${left}px`;
    }
  }

  function nearest(side, x) {
    const lane = $(`${side.id}-lane`), t = Number($('scrub').max) * x / Math.max(1, lane.clientWidth);
    let best = null;
    for (const event of side.answer ? side.answer.events : []) if (!best || Math.abs(event.t - t) < Math.abs(best.t - t)) best = event;
    return best;
  }

  document.addEventListener('DOMContentLoaded', () => {
    for (const id of ['own', 'expert']) {
      $(`${id}-lane`).addEventListener('click', event => {
        const side = sides.find(s => s.id === id), hit = side && nearest(side, event.clientX - $(`${id}-lane`).getBoundingClientRect().left);
        if (hit) jump(hit.t);
      });
    }
    window.addEventListener('resize', () => sides.forEach(draw));
  });

  return {
    /** Shows the events of an attempt and, if it has a name, of the demonstration. */
    async open(own, expert, jumpTo) {
      const mine = ++shown;
      jump = jumpTo;
      sides = [{id: 'own', session: own}, {id: 'expert', session: expert}].filter(s => s.session);
      $('expert-side').hidden = $('expert-lane-box').hidden = !expert;
      for (const id of ['own', 'expert']) {
        $(`${id}-events`).replaceChildren();
        $(`${id}-lane`).replaceChildren();
        setText($(`${id}-events-note`), 'Reading the recording.');
      }
      await Promise.all(sides.map(async side => {
        side.answer = await ask(side.session, () => mine === shown);
        if (mine === shown) fill(side);
      }));
    },
    close() { ++shown; sides = []; },
    /** Marks the newest event of each list at a time. */
    at(t) {
      for (const {answer, buttons} of sides) {
        if (!buttons) continue;
        let newest = -1;
        answer.events.forEach((event, i) => { if (event.t <= t + 0.05) newest = i; });
        buttons.forEach((button, i) => { if (i === newest) button.setAttribute('aria-current', 'time'); else button.removeAttribute('aria-current'); });
      }
    },
    /** The length of the slider has changed. */
    draw() { sides.forEach(draw); },
  };
})();
