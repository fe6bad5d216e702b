// Numbers as people read them, letter by letter as report/plots/numerals.py writes them: few digits, a true minus, powers
// of ten raised, SI prefixes.

const RAISED = { "-": "⁻", 0: "⁰", 1: "¹", 2: "²", 3: "³", 4: "⁴", 5: "⁵", 6: "⁶", 7: "⁷", 8: "⁸", 9: "⁹" };
const PREFIXES = [[1, ""], [1e-3, "m"], [1e-6, "µ"], [1e-9, "n"]];
const PLAIN = [1e-3, 1e5];
const MOST_DIGITS = 100; // of toExponential; a double of common size has fewer

const raised = (exponent) => `10${[...String(exponent)].map((sign) => RAISED[sign]).join("")}`;
const trimmed = (text) => (text.includes(".") ? text.replace(/0+$/, "").replace(/\.$/, "") : text);

// Mantissa and exponent of a number with some digits; halves go to the even digit, which toExponential takes upwards.
function rounded(value, digits) {
  const near = value.toExponential(digits - 1);
  const tail = value.toExponential(MOST_DIGITS).replace("-", "").replace(".", "").split("e")[0].slice(digits);
  const isOdd = /[13579]$/.test(near.split("e")[0]);
  if (!/^50*$/.test(tail) || !isOdd) return near.split("e");
  const [head, exponent] = near.split("e"), step = 10 ** (1 - digits), size = Math.abs(Number(head)) - step;
  return [`${head.startsWith("-") ? "-" : ""}${size.toFixed(digits - 1)}`, exponent];
}

// Plain notation from 0.001 to 100 000, mantissa and power of ten elsewhere; what is no number becomes a dash.
function numeral(value, digits = 4) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  if (!Number.isFinite(value)) return value > 0 ? "∞" : "−∞";
  if (value === 0) return "0";
  const [mantissa, exponent] = rounded(value, digits), near = Number(`${mantissa}e${exponent}`), size = Math.abs(near);
  if (size >= PLAIN[0] && size < PLAIN[1]) return trimmed(near.toFixed(Math.max(0, digits - 1 - Math.floor(Math.log10(size) + 1e-12)))).replace("-", "−");
  const short = trimmed(mantissa).replace("-", "−");
  return short === "1" ? raised(Number(exponent)) : `${short} × ${raised(Number(exponent))}`;
}

// The factor and the unit with a prefix in which magnitudes up to `largest` read well.
function prefixed(largest, unit) {
  if (unit === "" || unit === "1" || unit.startsWith("kg") || !(largest > 0 && largest < Infinity)) return [1, unit];
  if (largest >= 2e7 && unit.startsWith("N")) return [1e-6, `M${unit}`];
  if (largest >= 2e4 && unit.startsWith("N")) return [1e-3, `k${unit}`];
  const fitting = PREFIXES.find(([step]) => largest >= 0.5 * step);
  return fitting ? [1 / fitting[0], `${fitting[1]}${unit}`] : [1, unit];
}

// A number with its unit and an SI prefix.
function engineering(value, unit, digits = 3) {
  if (value === null || value === undefined || Number.isNaN(value)) return "–";
  const [factor, shown] = prefixed(Math.abs(value), unit), words = numeral(value * factor, digits);
  return shown && shown !== "1" ? `${words} ${shown}` : words;
}

export default { numeral, prefixed, engineering, raised };
