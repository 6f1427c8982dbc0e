'use strict';
// The generator's knobs: the setting that the supervisor reports, and buttons for a step up or down. Presses count from
// the setting wanted last, because the report follows a press only after some tenths of a second.

const generator = (() => {
  const kPatience = 3000;  // ms without an answer of the supervisor, or from its answer to a report of the setting.
  const knobs = new Map();
  let asked = null;  // The request that the supervisor has not answered: its time, and the notice shown before it.
  let notice = 0;

  function makeKnob(name, label) {
    const term = make('dt', '', label), item = make('dd', 'stepper'), value = make('output');
    const step = watts => {
      const button = make('button', '', watts < 0 ? '\u2212' : '+');
      Object.assign(button, {type: 'button', id: `${name}-${watts < 0 ? 'less' : 'more'}`});
      button.setAttribute('aria-label', `${label}: 5 watts ${watts < 0 ? 'less' : 'more'}`);
      button.addEventListener('click', () => {
        const knob = knobs.get(name);
        knob.wanted = Math.min(300, Math.max(0, (knob.wanted === null ? knob.watts : knob.wanted) + watts));
        knob.at = performance.now();
        sendWanted();
      });
      return button;
    };
    value.id = `set-${name}`;
    item.append(step(-5), value, step(5));
    $('knobs').append(term, item);
    knobs.set(name, {value, watts: 0, wanted: null, sent: null, at: 0});
  }
  for (const [name, label] of [['cut', 'Cut'], ['coag', 'Coag'], ['blend', 'Blend']]) makeKnob(name, label);

  function forget(knob) { knob.wanted = knob.sent = null; }

  /** Sends the newest settings. The supervisor answers one request at a time, so that others wait here. */
  async function sendWanted() {
    if (asked) return;
    const fields = {};
    for (const [name, knob] of knobs) if (knob.wanted !== knob.sent) fields[name] = knob.sent = knob.wanted;
    if (!Object.keys(fields).length) return;
    asked = {at: performance.now(), notice};
    if (await order('/api/generator', fields)) return;
    asked = null;
    for (const knob of knobs.values()) forget(knob);
  }

  return {
    /** Called with the figures and the notice of each state of a session. */
    show(figures, newest) {
      $('generator').hidden = !figures || figures.set_cut_W === undefined;
      const now = performance.now();
      notice = newest ? newest.number : 0;
      const answered = asked && notice !== asked.notice;
      if (answered || (asked && now - asked.at > kPatience)) asked = null;
      for (const [name, knob] of knobs) {
        if (!$('generator').hidden) {
          knob.watts = figures[`set_${name}_W`];
          setText(knob.value, `${knob.watts.toFixed(0)} W`);
        }
        // A report of the wanted setting that is older than the request says nothing.
        const reached = !asked && knob.wanted === knob.sent && Math.abs(knob.wanted - knob.watts) < 0.05;
        if (answered && !newest.ok || reached || now - knob.at > kPatience) forget(knob);
      }
      sendWanted();
    },
  };
})();
