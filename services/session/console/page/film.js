'use strict';
// The pictures of a recorded session, drawn anew by the console for each time that is asked for, over a WebSocket
// (services/session/console/attempt_films.h). The next time is asked for when the last picture has been drawn: a slow
// machine shows fewer pictures, not late ones.

/** Shows a session in a canvas, and in `note` why there is no picture. `known` is called with the time of its end. */
function openFilm(session, canvas, note, known) {
  const failed = why => setText(note, why);
  let socket = null, closed = false, ready = false, asked = null, wanted = 0, drawing = Promise.resolve();

  function ask() {
    if (!ready || asked !== null || !socket) return;
    asked = wanted;
    socket.send(`t=${asked.toFixed(3)}`);
  }
  async function draw(bytes) {
    const picture = await createImageBitmap(new Blob([bytes], {type: 'image/jpeg'}));
    if (canvas.width !== picture.width || canvas.height !== picture.height) {
      canvas.width = picture.width;
      canvas.height = picture.height;
    }
    canvas.getContext('2d').drawImage(picture, 0, 0);
    picture.close();
    setText(note, '');
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
    const answer = await call('/api/ticket', {}).then(r => r.json()).catch(() => null);
    if (closed) return;
    if (!answer || !answer.ok) return failed(answer ? answer.text : 'No response from the console.');
    socket = new WebSocket(`${location.origin.replace(/^http/, 'ws')}/film?ticket=${answer.text}`);
    socket.binaryType = 'arraybuffer';
    socket.onopen = () => socket.send(`session=${session}`);
    socket.onmessage = take;
    socket.onclose = () => { if (!closed) failed('The console shows no more of it; open it again.'); };
  })();

  return {
    show(time) { wanted = time; ask(); },
    close() { closed = true; if (socket) socket.close(); },
  };
}
