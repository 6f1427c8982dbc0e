'use strict';
// Courses, the person at the cart, attempts with score sheet and pictures. The person is known to the console, not to
// the page: all pages show the same.

const training = (() => {
  let shown = null, ran = false, seen;

  const item = (className, ...children) => {
    const element = make('li', className);
    element.append(...children);
    return element;
  };
  const button = (text, className, act) => {
    const element = make('button', className, text);
    element.type = 'button';
    element.addEventListener('click', act);
    return element;
  };
  const percent = value => `${value.toFixed(0)} %`;

  async function load() {
    const answer = await call('/api/training').then(r => r.json()).catch(() => null);
    if (!answer) return;
    if (answer.text) return toast(answer.text, true);
    // Only what has changed is made anew, and the button with the focus keeps it: the keyboard does not lose its place.
    if (JSON.stringify(answer) === JSON.stringify(shown)) return;
    shown = answer;
    const focus = document.activeElement, place = focus.getAttribute('aria-label'), attempt = focus.dataset.session;
    const person = answer.person;
    setText($('person'), person ? `${person}${answer.instructor ? ', instructor' : ''}` : 'Nobody has entered.');
    $('enter-form').hidden = !!person && !answer.instructor;
    $('leave').hidden = !person;
    $('csv').hidden = !person;
    $('courses').replaceChildren(...answer.courses.map(showCourse));
    trend.group(answer.group);
    const attempts = answer.attempts.map(showAttempt);
    $('attempts').replaceChildren(...attempts);
    if (!attempts.length) $('attempts').append(item('', person ? 'None yet: choose an exercise.' : 'Enter to see yours.'));
    if (focus.isConnected) return;
    const again = [...$('courses').querySelectorAll('button'), ...attempts.map(a => a.querySelector('button'))]
      .find(b => attempt ? b.dataset.session === attempt : b.getAttribute('aria-label') === place);
    if (again) again.focus();
  }

  function showCourse(course) {
    const section = make('section'), list = make('ul');
    section.append(make('h3', '', course.name), make('p', 'hint', course.description), list);
    for (const exercise of course.exercises) {
      const {scores, cohort} = exercise, {passed} = exercise, best = Math.max(...scores);
      const what = make('span', 'what', exercise.description.replace(/^Exercise: /, '').replace(/^./, c => c.toUpperCase()));
      what.append(make('small', '', `Passed from ${percent(exercise.pass)}. ` + (scores.length ? `${scores.length} done, best ${percent(best)}.` : 'Not tried yet.')));
      const mark = make('span', passed ? 'mark level-good' : 'mark level-off', passed ? '●' : '○');
      mark.setAttribute('role', 'img');
      mark.setAttribute('aria-label', passed ? 'passed' : 'not passed');
      const go = button('Operate', 'go', () => start(exercise, 'me'));
      go.disabled = !shown.person;
      go.setAttribute('aria-label', `Operate ${exercise.scene}`);
      const demonstrate = button('Demonstration', '', () => start(exercise, 'expert'));
      demonstrate.setAttribute('aria-label', `Demonstration of ${exercise.scene}`);
      list.append(item('', mark, what, ...(scores.length || cohort.length ? [trend.button(exercise)] : []), demonstrate, go));
    }
    return section;
  }

  async function start(exercise, trainee) {
    const byHand = trainee === 'me';
    // The replay of the attempt draws its recording.
    const fields = {scene: exercise.scene, record: 'on', hands: byHand ? 'on' : 'off', trainee};
    // Somebody else may have entered on another page: the console then refuses, and this page shows who.
    if (byHand) fields.person = shown.person;
    if (await order('/api/start', fields, byHand ? 'Take the controls when the picture comes (on a cart with Touch devices: these), and press Stop when you have finished.' : 'The script shows how it is done.')) ran = byHand;
    else load();
  }

  function showAttempt(attempt) {
    const what = make('span', 'what', `${attempt.scene}, ${percent(attempt.score)}`);
    what.append(make('small', '', `${shown.instructor ? `${attempt.trainee}, ` : ''}${attempt.started}${attempt.well ? '' : ', the session did not end well'}`));
    const go = button('Score and replay', '', () => open(attempt));
    go.dataset.session = attempt.session;
    return item('', what, go);
  }

  // ---------------------------------------------------------------------------------------------- one attempt

  let films = [], time = 0, playing = 0, opened = '';

  let opening = 0;
  async function open(attempt) {
    const mine = ++opening;
    const answer = await call(`/api/attempt?session=${attempt.session}`).then(r => r.json()).catch(() => null);
    if (mine !== opening) return;  // Another was opened meanwhile.
    if (!answer || answer.text) return toast(answer ? answer.text : 'No response from the console.', true);
    setText($('attempt-title'), `${attempt.scene}: ${percent(attempt.score)}`);
    const sheet = answer.sheet, rows = [];
    for (const [key, label] of Object.entries(answer.labels)) {
      if (!(sheet[`${key}.of`] > 0)) continue;
      const row = make('tr', sheet[`${key}.passed`] ? '' : 'bad');
      const number = value => value === null ? '–' : Number(value).toFixed(Math.abs(value) < 10 ? 2 : 0);
      row.append(make('td', '', label), make('td', 'number', number(sheet[key])), make('td', 'number', number(sheet[`${key}.threshold`])),
        make('td', 'number', sheet[`${key}.passed`] ? 'kept' : 'missed'), make('td', 'number', `${sheet[`${key}.points`].toFixed(1)} / ${sheet[`${key}.of`]}`));
      rows.push(row);
    }
    $('sheet').replaceChildren(...rows);
    play(false);
    for (const film of films) film.close();
    $('film-expert-box').hidden = !answer.expert;
    $('scrub').max = 0;
    $('play').disabled = true;
    opened = attempt.session;
    films = [['own', attempt.session], ['expert', answer.expert]].filter(([, session]) => session).map(([side, session]) =>
      openFilm(session, $(`film-${side}`), $(`film-${side}-note`), end => { lengthen(end); $('play').disabled = false; }));
    setTime(0);
    if (!$('attempt-box').open) $('attempt-box').showModal();
    // Events may be known before the recordings' ends.
    timeline.open(attempt.session, answer.expert, t => { play(false); lengthen(t); setTime(t); });
  }

  /** The slider's way contains a time. */
  function lengthen(end) {
    if (end <= Number($('scrub').max)) return;
    $('scrub').max = Math.ceil(20 * end) / 20;  // A whole number of the slider's steps.
    timeline.draw();
  }

  function setTime(seconds) {
    time = Math.min(Number($('scrub').max), Math.max(0, seconds));
    $('scrub').value = time;
    setText($('scrub-time'), `${time.toFixed(1)} s`);
    for (const film of films) film.show(time);
    timeline.at(time);
  }
  function play(on) {
    clearInterval(playing);
    playing = 0;
    setText($('play'), on ? 'Pause' : 'Play');
    if (!on) return;
    if (time >= Number($('scrub').max)) setTime(0);
    let last = performance.now();
    playing = setInterval(() => {
      const now = performance.now();
      setTime(time + Number($('speed').value) * (now - last) / 1000);
      last = now;
      if (time >= Number($('scrub').max)) play(false);
    }, 25);
  }

  document.addEventListener('DOMContentLoaded', () => {
    $('play').addEventListener('click', () => play(!playing));
    $('scrub').addEventListener('input', () => { play(false); setTime(Number($('scrub').value)); });
    $('attempt-box').addEventListener('close', () => {
      play(false);
      for (const film of films) film.close();
      films = [];
      timeline.close();
      // The button that opened it may be gone; the keyboard goes on at the attempt.
      ($('attempts').querySelector(`[data-session="${opened}"]`) || $('training-title')).focus();
    });
    $('attempt-close').addEventListener('click', () => $('attempt-box').close());
    const account = async (path, more) => {
      const form = $('enter-form');
      const answer = await order(path, {name: form.person_name.value.trim(), pin: form.pin.value, ...more});
      form.pin.value = '';
      if (!answer) return;
      form.reset();
      await load();
      $('training-title').focus();  // The form, with the focus, is hidden.
    };
    $('enter-form').addEventListener('submit', event => { event.preventDefault(); account('/api/training/enter', {}); });
    $('new-trainee').addEventListener('click', () => account('/api/training/new', {instructor: $('enter-form').instructor.checked ? 'on' : 'off'}));
    $('leave').addEventListener('click', async () => { await order('/api/training/leave'); await load(); $('training-title').focus(); });
    $('csv').addEventListener('click', async () => {
      const bytes = await call('/api/training.csv').then(r => r.ok ? r.blob() : null).catch(() => null);
      if (!bytes) return toast('No attempts could be read.', true);
      const link = make('a');
      link.href = URL.createObjectURL(bytes);
      link.download = 'attempts.csv';
      link.click();
      setTimeout(() => URL.revokeObjectURL(link.href), 10000);
    });
  });

  return {
    load,
    /** Called with each state. @param changes number of times that the person at the cart has changed, on any page. */
    at(changes) {
      if (changes === seen) return;
      const first = seen === undefined;
      seen = changes;
      if (!first) load();
    },
    /** Called when a session has ended: an attempt that began here is shown. @param session empty if it did not begin. */
    async ended(session) {
      if (!ran) return;
      ran = false;
      await load();
      // Without an attempt the view Session stays, which says why.
      const own = session && shown && shown.attempts.find(a => a.session === session && a.trainee === shown.person);
      if (!own) return;
      goTo('training');
      open(own);
    },
  };
})();
