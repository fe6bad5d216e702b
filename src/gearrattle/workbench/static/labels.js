// What jobs are called on the page: by their names, and those of one name by a number as well, the oldest first.

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
