'use strict';
// The questionnaire after a session: one row of answers for each question, then the means of all sessions. The answers
// belong to the session that was shown when the dialog was opened; another one may have begun since.

(() => {
  let session = '';

  const kWords = ['very poor', '', '', '', '', 'very good'];

  function row(question, number) {
    const fieldset = make('fieldset'), chips = make('div', 'chips');
    for (let answer = 0; answer < kWords.length; ++answer) {
      const label = make('label'), input = make('input'), text = make('span', '', `${answer}`);
      input.type = 'radio';
      input.name = `question${number}`;
      input.value = answer;
      input.required = true;
      if (kWords[answer]) text.append(make('small', '', ` ${kWords[answer]}`));
      label.append(input, text);
      chips.append(label);
    }
    fieldset.append(make('legend', '', `${number + 1}. ${question.text}`), chips);
    return fieldset;
  }

  const opinion = (mean, deviation) => mean === undefined ? '–' : `${mean.toFixed(1)} ± ${deviation.toFixed(2)}`;

  async function load() {
    const answer = await call('/api/questionnaire').then(r => r.json()).catch(() => null);
    if (!answer || !answer.questions) return toast('No response from the console.', true);
    if (!answer.session) return toast('The questionnaire is for a session that has ended.', true);
    session = answer.session;
    setText($('questionnaire-session'), `Session ${session}`);
    $('questions').replaceChildren(...answer.questions.map(row));
    setText($('opinions-people'), answer.people ? `Sessions with answers: ${answer.people}` : 'No session has answers yet.');
    $('opinions').replaceChildren(...answer.questions.map((question, number) => {
      const line = make('tr');
      line.append(make('td', '', `${number + 1}. ${question.text}`), make('td', 'number', opinion(question.mean, question.deviation)),
        make('td', 'number', opinion(question.paper_mean, question.paper_deviation)));
      return line;
    }));
    return true;
  }

  $('questionnaire').addEventListener('click', async () => {
    if (await load()) $('questionnaire-box').showModal();
  });
  $('questionnaire-close').addEventListener('click', () => $('questionnaire-box').close());
  $('questionnaire-form').addEventListener('submit', async event => {
    event.preventDefault();
    const answers = [...$('questions').querySelectorAll('input:checked')].map(input => input.value).join(',');
    if (!await order('/api/questionnaire/answers', {session, answers}, 'Stored. Thank you.')) return;
    $('questionnaire-box').close();
  });
})();
