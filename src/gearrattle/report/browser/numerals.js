// Numbers as people read them, letter by letter as report/plots/numerals.py writes them.

const PREFIXES = [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
const raised = (exponent) => `10${[...String(exponent)].map((sign) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[sign] ?? "⁻").join("")}`;
const trimmed = (text) => (text.includes(".") ? text.replace(/\.?0+$/, "") : text);
const isNone = (value) => value === null || value === undefined || Number.isNaN(value);

// Mantissa and exponent; halves go to the even digit, which toExponential takes upwards.
function rounded(value, digits) {
  const [head, exponent] = value.toExponential(digits - 1).split("e");
  const tail = value.toExponential(100).replace(/[-.]|e.*/g, "").slice(digits);
  if (!/^50*$/.test(tail) || !/[13579]$/.test(head)) return [head, exponent];
  return [(Number(head) - Math.sign(value) * 10 ** (1 - digits)).toFixed(digits - 1), exponent];
}

// Plain notation from 0.001 to 100 000, mantissa and power of ten elsewhere; what is no number becomes a dash.
function numeral(value, digits = 4) {
  if (isNone(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const [head, exponent] = rounded(value, digits), near = Number(`${head}e${exponent}`), size = Math.abs(near);
  if (size >= 1e-3 && size < 1e5) return trimmed(near.toFixed(Math.max(0, digits - 1 - Number(exponent)))).replace("-", "−");
  const short = trimmed(head).replace("-", "−");
  return short === "1" ? raised(Number(exponent)) : `${short} × ${raised(Number(exponent))}`;
}

// The factor and the unit in which magnitudes up to `largest` read well.
function prefixed(largest, unit) {
  if (["", "1"].includes(unit) || unit.startsWith("kg") || !(largest > 0 && largest < Infinity)) return [1, unit];
  if (largest >= 2e4 && unit.startsWith("N")) return largest >= 2e7 ? [1e-6, `M${unit}`] : [1e-3, `k${unit}`];
  const [step, prefix] = PREFIXES.find(([least]) => largest >= 0.5 * least) ?? PREFIXES[0];
  return [1 / step, prefix + unit];
}

// A number with its unit and an SI prefix.
function engineering(value, unit, digits = 3) {
  if (isNone(value)) return "–";
  const [factor, shown] = prefixed(Math.abs(value), unit);
  return `${numeral(value * factor, digits)} ${shown === "1" ? "" : shown}`.trim();
}

export default { numeral, engineering, raised };
