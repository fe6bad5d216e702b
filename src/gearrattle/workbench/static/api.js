// The HTTP interface as functions. What is refused is thrown as an Error with `.problems` ({place, value, rule, remedy})
// and `.status`. `api.events(callback)` hears of jobs over a socket, and joins again when the connection is lost.

const JOINED_AGAIN = [500, 1000, 2000, 5000]; // ms

async function failure(response) {
  let problems = [];
  try { problems = (await response.json()).problems ?? []; } catch { /* no JSON: the status says all there is */ }
  const words = problems.map(({ place, rule, remedy }) => `${place}: ${rule}${remedy ? ` (${remedy})` : ""}`).join("\n");
  return Object.assign(new Error(words || `The server answered ${response.status} ${response.statusText}`), { problems, status: response.status });
}

async function send(path, options) {
  let response;
  try { response = await fetch(path, { credentials: "same-origin", ...options }); } catch (error) {
    if (error.name === "AbortError") throw error;
    throw Object.assign(new Error("The server does not answer. Is gearrattle serve still running?"), { problems: [], status: 0 });
  }
  if (!response.ok) throw await failure(response);
  return response;
}

async function answer(path, options) {
  const response = await send(path, options);
  remember(path, response);
  const type = response.headers.get("content-type") ?? "";
  if (type.includes("json")) return response.json();
  return type.startsWith("text/") || type.includes("toml") || type.includes("python") ? response.text() : response.arrayBuffer();
}

// The tags of files that this tab read or wrote, by path: a file that has changed since is not written over.
const TAGS = "gearrattle.tags";
const tags = new Map(JSON.parse(sessionStorage.getItem(TAGS) ?? "[]"));

function remember(path, response) {
  const tag = response.headers.get("etag");
  if (!tag || !path.startsWith("/api/files/")) return;
  tags.set(path, tag);
  sessionStorage.setItem(TAGS, JSON.stringify([...tags]));
}

const json = (value) => ({ headers: { "content-type": "application/json" }, body: JSON.stringify(value) });

export const api = {
  get: (path, options) => answer(path, options),
  post: (path, value, options) => answer(path, { method: "POST", ...json(value ?? {}), ...options }),
  patch: (path, value) => answer(path, { method: "PATCH", ...json(value) }),
  delete: (path) => answer(path, { method: "DELETE" }),
  // Writes a file unless another program has changed it (status 412): of one that this tab has not read, unless it exists.
  put: (path, body) => answer(path, { method: "PUT", body, headers: tags.has(path) ? { "If-Match": tags.get(path) } : { "If-None-Match": "*" } }),
  // What is written next under this name is not what this tab read there: the question comes before it is replaced.
  forget: (path) => { tags.delete(path); sessionStorage.setItem(TAGS, JSON.stringify([...tags])); },
  // Writes a file over whatever stands there.
  replace: (path, body) => answer(path, { method: "PUT", body }),
  buffer: async (path, options) => (await send(path, options)).arrayBuffer(),

  // callback(message) for every message; callback({joined: true}) when the connection stands, {joined: false} when it
  // is lost. Returns what closes it.
  events(callback) {
    let socket = null, attempt = 0, isClosed = false, timer = 0;
    const join = () => {
      socket = new WebSocket(`${location.protocol === "https:" ? "wss" : "ws"}://${location.host}/api/events`);
      socket.onopen = () => { attempt = 0; callback({ joined: true }); };
      socket.onmessage = (event) => callback(JSON.parse(event.data));
      socket.onclose = () => {
        if (isClosed) return;
        callback({ joined: false });
        timer = setTimeout(join, JOINED_AGAIN[Math.min(attempt++, JOINED_AGAIN.length - 1)]);
      };
    };
    join();
    return () => { isClosed = true; clearTimeout(timer); socket.close(); };
  },
};

export default api;
