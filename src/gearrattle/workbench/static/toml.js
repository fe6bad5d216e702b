// The text of a model file with colours, line numbers and marks of problems: a text area above the same text in colour.

import { html, useEffect, useRef } from "/static/vendor/htm-preact.js";

const TOKEN = /(#.*$)|("""|'''|"(?:[^"\\]|\\.)*"|'[^']*')|(^\s*\[\[?[^\]]*\]?\]?)|([A-Za-z0-9_-]+)(?=\s*=)|([+-]?(?:\d|\.\d)[\d_.eE+-]*)/g;
const CLASSES = [null, "t-comment", "t-text", "t-head", "t-key", "t-number"];
const MOST_COLOURED = 60_000; // characters: beyond, the text stays plain

function coloured(line) {
  const parts = [];
  let at = 0;
  for (const match of line.matchAll(TOKEN)) {
    const kind = match.slice(1).findIndex((group) => group !== undefined) + 1;
    if (match.index > at) parts.push(line.slice(at, match.index));
    parts.push(html`<span class=${CLASSES[kind]}>${match[0]}</span>`);
    at = match.index + match[0].length;
  }
  parts.push(line.slice(at) || (at ? "" : " "));
  return parts;
}

// problems: [{line, rule}]; range: [first, last] lines of what is selected, counted from 1.
export function TomlText({ text, problems, range, onText, onLine }) {
  const area = useRef(null), back = useRef(null);
  const marked = new Map(problems.filter(({ line }) => line).map(({ line, rule }) => [line, rule]));
  const scrolled = () => { back.current.scrollTop = area.current.scrollTop; back.current.scrollLeft = area.current.scrollLeft; };
  useEffect(() => {
    if (!range || document.activeElement === area.current) return;
    const height = area.current.scrollHeight / Math.max(1, text.split("\n").length), top = (range[0] - 2) * height;
    if (top < area.current.scrollTop || range[1] * height > area.current.scrollTop + area.current.clientHeight) area.current.scrollTop = Math.max(0, top);
    scrolled();
  }, [range?.[0], range?.[1]]);
  const caret = () => onLine(text.slice(0, area.current.selectionStart).split("\n").length);
  const lines = text.split("\n");
  const isPlain = text.length > MOST_COLOURED;
  return html`<div class="toml">
    <pre class="toml-back" aria-hidden="true" ref=${back}>${lines.map((line, k) => html`<div class=${`toml-line${marked.has(k + 1) ? " wrong" : ""}${range && k + 1 >= range[0] && k + 1 <= range[1] ? " in" : ""}`} title=${marked.get(k + 1)}>${isPlain ? line || " " : coloured(line)}</div>`)}</pre>
    <textarea class="toml-area" aria-label="Model file (TOML)" spellcheck="false" autocomplete="off" wrap="off" ref=${area} value=${text}
      onInput=${(event) => onText(event.target.value)} onScroll=${scrolled} onClick=${caret} onKeyUp=${(event) => event.key.startsWith("Arrow") && caret()}></textarea>
  </div>`;
}
