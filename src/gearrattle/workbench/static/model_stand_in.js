// What a widget has for its model on the page: the calls of anywidget's model, with questions answered over HTTP.

import { api } from "/static/api.js";

const window_ = ({ from, to, points }) => `from=${from}&to=${to}&points=${points}`;
const channelsOf = (names) => names.map((name) => `channel=${encodeURIComponent(name)}`).join("&");

// Answers of a job: by what is asked, a function of the question; it returns {content, buffers}.
export function jobAnswers(id, others = {}) {
  const path = `/api/jobs/${encodeURIComponent(id)}`;
  return {
    figure: async ({ name, is_chart }) => (is_chart
      ? { content: { chart: await api.get(`${path}/figures/${encodeURIComponent(name)}.json`) } }
      : { content: { svg: `${path}/figures/${encodeURIComponent(name)}.svg` } }),
    motions: async () => ({ content: { motions: await api.get(`${path}/motions`) } }),
    channels: async () => ({ content: await api.get(`${path}/traces`) }),
    trace: async (question) => ({ buffers: [await api.buffer(`${path}/trace?${channelsOf(question.channels)}&${window_(question)}`)] }),
    impacts: async (question) => ({ buffers: [await api.buffer(`${path}/impacts?${window_(question)}`)] }),
    sound: async () => {
      const { gain, designs: [{ problems }] } = await api.get(`/api/sound?jobs=${encodeURIComponent(id)}`);
      return { content: problems.length ? { problems } : { url: `${path}/sound.wav`, gain } };
    },
    ...others,
  };
}

export function fileAnswers(file) {
  const query = `file=${encodeURIComponent(file)}`;
  return {
    channels: async () => ({ content: await api.get(`/api/measured?${query}`) }),
    trace: async (question) => ({ buffers: [await api.buffer(`/api/measured/trace?${query}&${channelsOf(question.channels)}&${window_(question)}`)] }),
  };
}

export function standIn(values, answers = {}) {
  const heard = new Map();
  const tell = (name, ...what) => [...(heard.get(name) ?? [])].forEach((hear) => hear(...what));
  return {
    get: (key) => values[key],
    set: (key, value) => { values[key] = value; tell(`change:${key}`, value); },
    save_changes: () => {},
    on: (name, hear) => heard.set(name, [...(heard.get(name) ?? []), hear]),
    off: (name, hear) => heard.set(name, (heard.get(name) ?? []).filter((other) => other !== hear)),
    send: async (question) => {
      const { id } = question;
      try {
        if (!answers[question.ask]) throw Object.assign(new Error("nothing answers this"), { problems: [] });
        const { content, buffers } = await answers[question.ask](question);
        tell("msg:custom", { ...content, id }, buffers ?? []);
      } catch (error) {
        const problems = error.problems?.length ? error.problems : [{ place: question.ask, value: "", rule: error.message, remedy: "" }];
        tell("msg:custom", { id, problems }, []);
      }
    },
  };
}
