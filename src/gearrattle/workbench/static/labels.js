// What jobs are called on the page: by their names, and those of one name by a number as well, the oldest first.

const MOST = 120; // letters of a name

// jobs: newest first.
export function labelled(jobs) {
  const counts = new Map();
  const label = (job) => {
    const name = job.name || job.task, count = (counts.get(name) ?? 0) + 1;
    counts.set(name, count);
    return count > 1 ? `${name} (${count})` : name;
  };
  return [...jobs].reverse().map((job) => ({ ...job, label: label(job) })).reverse();
}

// What a run is called after the values it was given: [[path, value]] with the words that a check has for paths.
export const named = (values, labels) => values.map(([path, value]) => [labels[path] ?? path, value].join(" ")).join(", ").slice(0, MOST);

// What a job is called after the values it varies.
export const about = (words, paths, labels) => `${words} ${paths.map((path) => labels[path] ?? path).join(" and ")}`.slice(0, MOST);
