'use strict';
// The pictures of a recorded session, drawn anew by the console for each time that is asked for, over a WebSocket
// (services/session/console/attempt_films.h). The next time is asked for when the last picture has been drawn: a slow
// machine shows fewer pictures, not late ones.

/** Shows a session in a canvas, and in `note` why there is no picture. `known` is called with the time of its end. */
function openFilm(session, canvas, note, known) {
  const kPatience = 2000;  // ms until the page says that it waits.
  let socket = null, broken = false, slow = 0, ready = false, asked = null, wanted = 0, drawing = null, shown = false;

  function failed(why) {
    if (broken) return;
    broken = true;
    clearTimeout(slow);
    setText(note, why);
  }
  function ask() {
    if (!ready || asked !== null || !socket) return;
    asked = wanted;
    slow = setTimeout(() => setText(note, 'The picture is being drawn.'), kPatience);
    socket.send(`t=${asked.toFixed(3)}`);
  }
  async function draw(bytes) {
    await drawPicture(new Blob([bytes], {type: 'image/jpeg'}), canvas, () => broken);
    canvas.dataset.pictures = Number(canvas.dataset.pictures || 0) + 1;
  }
  async function take(message) {
    if (typeof message.data !== 'string') {
      drawing = draw(message.data).catch(() => {});
      return;
    }
    const answer = JSON.parse(message.data);
    if (answer.trouble) return failed(answer.trouble);
    if (answer.end !== undefined) {
      ready = true;
      known(answer.end);
    } else {
      await drawing;
      if (broken) return;
      clearTimeout(slow);
      shown = shown || !!drawing;
      setText(note, shown ? '' : 'The recording has no picture.');
      canvas.dataset.time = answer.t;
      const again = asked !== wanted;
      asked = null;
      if (!again) return;
    }
    ask();
  }

  canvas.getContext('2d').clearRect(0, 0, canvas.width, canvas.height);
  delete canvas.dataset.time;
  setText(note, 'Opening the recording.');
  (async () => {
    let opened;
    try {
      opened = await openSocket('/film');
    } catch (error) { return failed(`No connection to the console: ${error.message}`); }
    if (broken) return opened.close();
    socket = opened;
    socket.onopen = () => socket.send(`session=${session}`);
    socket.onmessage = take;
    socket.onclose = () => failed('The connection to the console has ended. Close this attempt and open it again.');
  })();

  return {
    show(time) { wanted = time; ask(); },
    close() { broken = true; clearTimeout(slow); if (socket) socket.close(); },
  };
}
