// The model of a job: its text, the file that names of data files are relative to, and what a check reads in it.

import { api } from "/static/api.js";

export async function modelOf(id) {
  const path = `/api/jobs/${encodeURIComponent(id)}`;
  const [{ file }, text] = await Promise.all([api.get(path), api.get(`${path}/model.toml`)]);
  const { tables, title, units, labels, groups } = await api.post("/api/check", { text, file });
  return { text, file, tables, title, units, labels: { ...labels, ...groups }, groups: Object.keys(groups) };
}
